#include "tests/support/browser.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "tests/support/temporary_folder.h"
#include "tools/process/shell_command.h"
#include "tools/process/shell_text.h"
#include "tools/text/xml_text.h"

namespace mray::test {
namespace {

/// A window of Chromium is at least 500 pixels wide, an <iframe> is not.
constexpr const char* kFrame = R"html(<!DOCTYPE html><meta charset="utf-8">
<style>html,body{{margin:0;overflow:hidden}}iframe{{border:0;display:block}}</style>
<iframe id="page" width="{0}" height="{1}" srcdoc="{2}"></iframe>
<script>
addEventListener("load", () => {{
  const page = document.getElementById("page").contentDocument;
  const bright = (colour) => {{
    const c = colour.match(/[0-9.]+/g).map(Number);
    return Math.round((c[0] + c[1] + c[2]) / 3);
  }};
  let least = 1e9;
  const walk = page.createTreeWalker(page.body, NodeFilter.SHOW_TEXT);
  while (walk.nextNode()) {{
    const parent = walk.currentNode.parentElement;
    const box = parent.getBoundingClientRect();
    if (!walk.currentNode.nodeValue.trim() || box.width === 0 || box.height === 0) continue;
    let size = parseFloat(getComputedStyle(parent).fontSize);
    const svg = parent.closest("svg");
    if (svg) size *= svg.getBoundingClientRect().width / svg.viewBox.baseVal.width;
    least = Math.min(least, size);
  }}
  let excess = 0;
  for (const svg of page.querySelectorAll("svg")) {{
    const place = svg.parentElement;
    excess = Math.max(excess, place.scrollWidth - place.clientWidth);
  }}
  const style = getComputedStyle(page.body);
  const answer = {{
    content_width: page.documentElement.scrollWidth,
    drawing_excess: excess,
    least_text_px: least,
    background: bright(style.backgroundColor),
    foreground: bright(style.color),
    text: page.body.innerText}};
  const element = document.createElement("pre");
  element.id = "answer";
  element.hidden = true;
  // Without the characters that the text of the document would have as entities.
  element.textContent = JSON.stringify(answer).replace(
      /[<>&\u00a0]/g, (c) => "\\u" + c.charCodeAt(0).toString(16).padStart(4, "0"));
  document.body.append(element);
}});
</script>
)html";
constexpr int kHeight = 900;

std::string browse(const TemporaryFolder& folder, const std::string& options,
                   const std::string& file) {
    return run_shell(fmt::format("cd {} && HOME={} timeout 120 chromium --headless --no-sandbox "
                                 "--disable-gpu --disable-dev-shm-usage --hide-scrollbars "
                                 "--user-data-dir={} {} {} 2>/dev/null",
                                 shell_quoted(folder.path().string()),
                                 shell_quoted(folder.file("home")),
                                 shell_quoted(folder.file("profile")), options, shell_quoted(file)))
        .text;
}

/// The file in the folder for people to look at, or in the temporary one.
std::string kept_file(const TemporaryFolder& folder, const std::string& name) {
    const char* const kept = std::getenv("MORPHRAY_SCREENSHOTS");
    return kept != nullptr ? std::string(kept) + "/" + name : folder.file(name);
}

}  // namespace

bool has_browser() { return run_shell("command -v chromium && command -v pdftotext").status == 0; }

ShownPage show_page(const std::string& html, int width, bool dark, const std::string& name) {
    const TemporaryFolder folder;
    folder.write("frame.html",
                 fmt::format(fmt::runtime(kFrame), width, kHeight, xml_escaped(html)));
    const std::string options = fmt::format(
        "{} --window-size={},{}", dark ? "--force-dark-mode" : "", std::max(500, width), kHeight);
    if (std::getenv("MORPHRAY_SCREENSHOTS") != nullptr) {
        browse(folder,
               fmt::format("{} --screenshot={}", options,
                           shell_quoted(kept_file(folder, fmt::format("{}-{}-{}.png", name, width,
                                                                      dark ? "dark" : "light")))),
               "frame.html");
    }
    const std::string dom = browse(folder, options + " --dump-dom", "frame.html");
    const std::string begin = "<pre id=\"answer\" hidden=\"\">";
    const std::size_t at = dom.find(begin);
    if (at == std::string::npos) throw std::runtime_error(name + ": chromium gave no answer");
    const std::size_t from = at + begin.size();
    const auto answer = nlohmann::json::parse(dom.substr(from, dom.find("</pre>", from) - from));
    return {answer["content_width"], answer["drawing_excess"], answer["least_text_px"],
            answer["background"],    answer["foreground"],     answer["text"]};
}

std::string printed_text(const std::string& html, const std::string& name) {
    const TemporaryFolder folder;
    folder.write("page.html", html);
    const std::string pdf = kept_file(folder, name + ".pdf");
    browse(folder, "--no-pdf-header-footer --print-to-pdf=" + shell_quoted(pdf), "page.html");
    return run_shell(fmt::format("pdftotext -layout {} -", shell_quoted(pdf))).text;
}

}  // namespace mray::test

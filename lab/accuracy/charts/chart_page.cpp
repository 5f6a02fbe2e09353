#include "lab/accuracy/charts/chart_page.h"

#include <fmt/format.h>

#include "common/report/xml_text.h"

namespace mray::accuracy {
namespace {

/// The <svg> element, without the head of a file.
std::string inline_svg(const std::string& svg) {
    const std::size_t begin = svg.find("<svg");
    return begin == std::string::npos ? std::string() : svg.substr(begin);
}

// Images are scrolled on phones, because type that a browser shrinks cannot be read. gnuplot's
// colours are those of a white page; dark pages turn them round and keep their hues.
constexpr const char* kHead = R"(<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8">
<meta name="viewport" content="width=device-width,initial-scale=1">
<title>morphray chart</title>
<style>
:root{color-scheme:light dark;--fg:#222;--bg:#fff;--line:#ddd;--soft:#f6f6f6;--link:#0a4fa3}
@media (prefers-color-scheme:dark){:root{--fg:#e2e2e2;--bg:#000;--line:#444;--soft:#1c1c1c;
--link:#8cc1ff}.chart svg{filter:invert(1) hue-rotate(180deg)}}
*{box-sizing:border-box}html{-webkit-text-size-adjust:100%}
body{font:14px/1.5 Helvetica,Arial,sans-serif;max-width:1280px;margin:0 auto;padding:16px;
color:var(--fg);background:var(--bg);overflow-wrap:anywhere}
h1,h2{font-size:16px}h2{margin-top:3em}a{color:var(--link)}
.chart{overflow-x:auto}.chart svg{display:block}
pre,code{font-size:14px}pre{overflow-x:auto;background:var(--soft);padding:.8em}
dt{font-weight:600}dd{margin:0 0 .3em 1.2em}
@page{size:A4 landscape;margin:12mm}
@media print{:root{color-scheme:light;--fg:#000;--bg:#fff;--soft:#fff}
body{padding:0;max-width:none}h2{margin-top:2em;break-after:avoid}h2+p{break-after:avoid}
.chart{overflow:visible;break-inside:avoid}
.chart svg{filter:none;max-width:100%;max-height:155mm;height:auto}
pre{white-space:pre-wrap;overflow:visible;font-size:8px}}
</style></head><body>
<h1>morphray chart</h1>
)";

constexpr const char* kWords = R"(<details><summary>What the words mean</summary><dl>
<dt>right</dt><dd>the triangle that is nearest in exact arithmetic over the given floats, one with exactly its t, or rightly none</dd>
<dt>close</dt><dd>another triangle that is hit too, at most 4 ulp of t farther; not counted as wrong</dd>
<dt>displaced</dt><dd>what a line sees that runs beside the ray, 2^-21 of the triangle's size away; not counted as wrong</dd>
<dt>beside</dt><dd>a neighbour at the same depth that is not hit; not counted as wrong</dd>
<dt>leak</dt><dd>nothing, or something behind, although a surface is hit, within 2^-12 of an edge</dd>
<dt>false miss, false hit, wrong triangle</dt><dd>what they say, wherever else</dd>
</dl></details>
)";

}  // namespace

std::string chart_page(const std::vector<PagedChart>& charts, const std::string& machine,
                       const std::string& command) {
    std::string page = kHead;
    page +=
        fmt::format("<p>{}<br><code>{}</code></p>\n", xml_escaped(machine), xml_escaped(command));
    page += kWords;
    for (const PagedChart& paged : charts) {
        const Chart& chart = *paged.chart;
        page += fmt::format("<h2 id=\"{}\">{}</h2>\n<p>{}</p>\n", chart.name,
                            xml_escaped(chart.figure.title), xml_escaped(chart.caption));
        // A figure that is too wide can be scrolled, also by keys.
        if (!paged.svg.empty()) {
            page += fmt::format("<div class=\"chart\" tabindex=\"0\">{}</div>\n",
                                inline_svg(paged.svg));
        }
        if (chart.table.empty()) continue;
        page += fmt::format("<details><summary>{}.csv</summary><pre>{}</pre></details>\n",
                            chart.name, xml_escaped(chart.table.text()));
    }
    return page + "</body></html>\n";
}

}  // namespace mray::accuracy

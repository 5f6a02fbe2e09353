#include "accuracy/charts/chart_page.h"

#include <fmt/format.h>

#include "tools/text/xml_text.h"

namespace mray::accuracy {
namespace {

/// The <svg> element, without the head of a file.
std::string inline_svg(const std::string& svg) {
    const std::size_t begin = svg.find("<svg");
    return begin == std::string::npos ? std::string() : svg.substr(begin);
}

constexpr const char* kHead = R"(<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>morphray chart</title>
<style>
body{font:15px/1.45 system-ui,sans-serif;max-width:1500px;margin:1.5em auto;padding:0 1em;color:#222}
svg{width:100%;height:auto;border:1px solid #ddd}
pre{overflow:auto;font-size:12px;background:#f6f6f6;padding:.8em}
dt{font-weight:600}dd{margin:0 0 .3em 1.2em}h2{margin-top:2em}
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
        page += fmt::format("<h2 id=\"{}\">{}</h2>\n<p>{}</p>\n{}\n", chart.name,
                            xml_escaped(chart.figure.title), xml_escaped(chart.caption),
                            inline_svg(paged.svg));
        if (chart.table.empty()) continue;
        page += fmt::format("<details><summary>{}.csv</summary><pre>{}</pre></details>\n",
                            chart.name, xml_escaped(chart.table.text()));
    }
    return page + "</body></html>\n";
}

}  // namespace mray::accuracy

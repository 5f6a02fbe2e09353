#include "app/report/crosscheck/html_parts.h"

namespace mray::app {

const char* const kPageStyle = R"css(
:root{color-scheme:light dark;--fg:#1b1f24;--bg:#fff;--muted:#4d5661;--line:#c5ccd3;--soft:#f3f5f7;
--link:#0a4fa3;--good:#14592b;--good-bg:#e3f4e7;--bad:#941616;--bad-bg:#fdeaea;--mark:#ffe58f}
@media (prefers-color-scheme:dark){:root{--fg:#e6edf3;--bg:#0f141a;--muted:#adb7c2;--line:#3f4954;
--soft:#1a2129;--link:#8cc1ff;--good:#8be9ab;--good-bg:#12301d;--bad:#ffb8b3;--bad-bg:#3d1a1a;
--mark:#6b5200}}
*{box-sizing:border-box}
html{-webkit-text-size-adjust:100%}
body{font:16px/1.5 system-ui,sans-serif;max-width:76rem;margin:0 auto;padding:1rem;color:var(--fg);
background:var(--bg);overflow-wrap:anywhere}
h1{font-size:1.3rem;margin:.2em 0 .5em}h2{font-size:1.25rem;margin:2em 0 .5em}
h3{font-size:1.05rem;margin:1.5em 0 .5em}
a{color:var(--link)}
:focus-visible{outline:3px solid var(--link);outline-offset:2px}
.verdict{border:2px solid;border-left-width:.6rem;border-radius:.3rem;padding:.6rem .9rem;margin:0}
.verdict strong{display:block;font-size:1.5rem;line-height:1.3}
.good{color:var(--good);background:var(--good-bg)}.bad{color:var(--bad);background:var(--bad-bg)}
.note{color:var(--muted);margin:.5em 0}
.scroll{overflow-x:auto;border:1px solid var(--line);border-radius:.3rem;max-width:100%}
table{border-collapse:collapse;font-size:.9rem;overflow-wrap:normal}
caption{text-align:left;padding:.4rem .6rem;color:var(--muted)}
th,td{border:1px solid var(--line);padding:.3rem .6rem;text-align:left;white-space:nowrap;
background:var(--bg)}
thead th,th[scope=row]{background:var(--soft);font-weight:600}
.matrix th[scope=row]{position:sticky;left:0;white-space:normal;min-width:min(15rem,40vw);
max-width:40vw}
td.bad{background:var(--bad-bg)}td.bad a{color:var(--bad);font-weight:600}
td.good{background:var(--bg)}
.values{font-variant-numeric:tabular-nums}.values td{font-family:ui-monospace,monospace}
mark{background:var(--mark);color:var(--fg);text-decoration:underline}
.kinds{list-style:none;padding:0;margin:.3em 0;display:flex;flex-wrap:wrap;gap:.2rem 1.2rem}
.swatch{display:inline-block;width:.9em;height:.9em;border:1px solid var(--fg);margin-right:.4em;
vertical-align:-.1em}
.pictures{display:flex;flex-wrap:wrap;gap:1rem;margin:.8rem 0}
figure{margin:0;flex:1 1 18rem;max-width:32rem;min-width:0}
figcaption{font-size:.9rem;color:var(--muted)}
img{display:block;width:100%;height:auto;image-rendering:pixelated;background:var(--soft)}
.stage{position:relative}
.stage.on .actual{position:absolute;inset:0;height:100%;clip-path:inset(0 0 0 var(--cut))}
.stage.on::after{content:"";position:absolute;top:0;bottom:0;left:var(--cut);width:2px;
margin-left:-1px;background:var(--link)}
.stage.whole .actual{clip-path:none}.stage.none .actual{visibility:hidden}
.stage.whole::after,.stage.none::after{display:none}
.controls{display:flex;flex-wrap:wrap;gap:.5rem 1rem;align-items:center;margin:.5rem 0}
.controls[hidden]{display:none}.controls label{flex:1 1 12rem;font-size:.9rem}
input[type=range]{display:block;width:100%;height:1.8rem;margin:0;accent-color:var(--link)}
button{font:inherit;font-size:.9rem;padding:.3rem .9rem;min-height:2.2rem;border-radius:.3rem;
border:1px solid var(--fg);color:var(--fg);background:var(--soft);cursor:pointer}
button[aria-pressed=true]{background:var(--fg);color:var(--bg)}
.command{display:flex;flex-wrap:wrap;gap:.4rem .8rem;align-items:center;margin:.4rem 0}
.command code{flex:1 1 16rem;min-width:0}
code{font:.85rem/1.45 ui-monospace,monospace;background:var(--soft);padding:.15rem .3rem;
border-radius:.2rem;white-space:pre-wrap}
dl{display:grid;grid-template-columns:minmax(7rem,max-content) minmax(0,1fr);gap:.3rem 1rem;margin:0}
dt{font-weight:600}dd{margin:0}
.variants{columns:18rem;margin:.3em 0 .8em;padding-left:2.2em}
.matrix.tall th[scope=row]{min-width:0;position:static}
.matrix.tall tbody th[scope=rowgroup]{position:sticky;left:0;vertical-align:top}
small{font:.8rem system-ui,sans-serif}
@media (max-width:30rem){dl{display:block}dd{margin:0 0 .5rem}th,td{padding:.3rem .4rem}}
@page{margin:12mm}
@media print{:root{color-scheme:light;--fg:#000;--bg:#fff;--muted:#333;--line:#999;--soft:#f3f5f7;
--link:#000;--good:#14592b;--good-bg:#fff;--bad:#941616;--bad-bg:#fdeaea;--mark:#ffe58f}
*{-webkit-print-color-adjust:exact;print-color-adjust:exact}
body{font-size:10pt;max-width:none;padding:0}
.scroll{overflow:visible;border:0}
table{font-size:7pt;width:100%}small{font-size:inherit}
th,td{white-space:normal;overflow-wrap:anywhere;padding:.1rem .25rem}
.matrix th{position:static!important;min-width:0!important;max-width:none!important}
thead{display:table-header-group}tr,figure,.command{break-inside:avoid}
h2,h3,caption{break-after:avoid}
a{text-decoration:none}
.controls,button,#said{display:none!important}
figure{flex:1 1 0;max-width:62mm}figure[data-compare]{flex-grow:2;max-width:none}
.stage{display:grid;grid-template-columns:1fr 1fr;gap:2mm}
.stage.on .actual{position:static;height:auto;clip-path:none;visibility:visible}
.stage.on::after{display:none}}
)css";

}  // namespace mray::app

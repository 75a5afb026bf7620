#pragma once

namespace darkbox {

/// The report's style: light and dark after the reader's own setting.
inline constexpr const char* report_style = R"css(
:root { color-scheme: light dark; --ink: #1d2430; --soft: #667085; --line: #d9dee7; --paper: #f6f7f9; --card: #ffffff;
        --accent: #2f6fde; --warn: #9a5b00; --warn-paper: #fff4df; --mark: #d9342b; }
@media (prefers-color-scheme: dark) {
  :root { --ink: #e6e9ef; --soft: #98a2b3; --line: #323a47; --paper: #14181f; --card: #1c222b; --accent: #7aa7ff;
          --warn: #ffcf7d; --warn-paper: #33280f; --mark: #ff6b60; } }
* { box-sizing: border-box; }
body { margin: 0; background: var(--paper); color: var(--ink); font: 15px/1.5 system-ui, "Segoe UI", Roboto, sans-serif; }
main { max-width: 1180px; margin: 0 auto; padding: 32px 24px 64px; }
h1 { margin: 0 0 4px; font-size: 28px; letter-spacing: -0.01em; }
h2 { margin: 40px 0 12px; font-size: 18px; }
.sub { color: var(--soft); margin: 0 0 20px; }
.warnings { margin: 0 0 20px; padding: 12px 16px 12px 34px; border-left: 4px solid var(--warn); background: var(--warn-paper);
            color: var(--warn); border-radius: 6px; }
.fine { color: var(--soft); }
.grid-of { display: grid; gap: 16px; grid-template-columns: repeat(auto-fill, minmax(340px, 1fr)); }
.small { grid-template-columns: repeat(auto-fill, minmax(250px, 1fr)); }
figure, .card { margin: 0; padding: 12px; background: var(--card); border: 1px solid var(--line); border-radius: 10px; }
figure img { display: block; width: 100%; height: auto; background: #000; border-radius: 6px; image-rendering: auto; }
figcaption { margin-top: 8px; }
figcaption b { display: block; }
figcaption span { color: var(--soft); font-size: 13px; }
table { width: 100%; border-collapse: collapse; font-variant-numeric: tabular-nums; font-size: 13.5px; }
th, td { padding: 5px 10px; border-bottom: 1px solid var(--line); text-align: right; }
th { color: var(--soft); font-weight: 500; }
th:first-child, td:first-child, .facts td, .text { text-align: left; }
.facts td:first-child { color: var(--soft); width: 34%; }
tr.unused { opacity: 0.5; text-decoration: line-through; }
.scroll { overflow-x: auto; }
.plot { display: block; width: 100%; max-width: 460px; margin: 0 auto; }
.plot.wide { max-width: none; }
.plot .grid { fill: none; stroke: var(--line); }
.plot .tick { fill: var(--soft); font-size: 11px; }
.plot .end { text-anchor: end; }
.plot .middle { text-anchor: middle; }
.plot .label { fill: var(--ink); font-size: 12px; }
.plot .lamp { fill: var(--accent); }
.plot .unused .lamp { fill: none; stroke: var(--soft); }
.plot .sigma { fill: var(--accent); fill-opacity: 0.18; stroke: var(--accent); stroke-opacity: 0.5; }
.plot .bar { fill: var(--accent); }
.plot .outline { fill: none; stroke: #40e0ff; }
.plot .highlight .sigma { fill: #ffb347; stroke: #ffb347; stroke-opacity: 0.9; }
.plot .axis { stroke: var(--soft); stroke-width: 0.8; }
.plot .highlight circle { fill: none; stroke: var(--mark); }
)css";

}  // namespace darkbox

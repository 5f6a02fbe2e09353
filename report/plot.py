# plot.py SPEC svg|pdf|png [narrow]: draws the figure that a JSON file describes to stdout, 25 cm wide, or narrow:
# 8.5 cm, for phones and columns of a paper. report/plot.cpp starts it. SPEC has title, details (not drawn,
# but in the file), panels, and csv, the text of a table, whose column "disturbed" is not empty where a speed means
# little. Of panels:
#   kind (lines, points or map), title, note (below it), xlabel, ylabel
#   x, y, lower, upper, xlower, xupper  columns of numbers, and of the ends of bars or of a light band
#   series, family  columns of what tells curves apart or names the rows of a map, and of what shares a colour
#   where, is  only rows with this text in that column
#   label, front  of points: the column of names beside them, without which a row is left out, and the name of
#              the line of what no other beats in both
#   event      of lines: the column of texts at some points
#   across, method, shade, number, percent  of a map: its columns, which of them or the rows are methods, its
#              numbers, others before them, and whether they are in % from 10,000 on
import csv
import io
import json
import math
import re
import sys
import textwrap

import matplotlib
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator

# The colours of M. Okabe and K. Ito, Color Universal Design, 2008. Marks differ for print in grey.
FAMILIES = {"ours": ("#0072B2", "o"), "Vulkan": ("#56B4E9", "P"), "2007": ("#D55E00", "s"),
            "Embree fast": ("#E69F00", "^"), "Embree robust": ("#009E73", "v"), "rules": ("#CC79A7", "D"),
            "GPU peer": ("#7F7F7F", "X")}
DASHES = ["-", (0, (5, 2)), (0, (1.5, 1.5)), (0, (6, 2, 1, 2))]
# Of no wrong answer, up to 10 in a million, and so on (C. Brewer, M. Harrower. ColorBrewer, "YlOrBr". 2003).
SHADES = ["#F2F7FA", "#FFF7BC", "#FEE391", "#FEC44F", "#FE9929", "#EC7014", "#A63603"]
INK, GREY = "#222222", "#666666"


def number(row, column):
    return float(row[column] or "nan")


def short(value):
    """Such as 0.67, 15.3, 153, 1k, 44M; nothing for NaN."""
    for unit, name in ((1e6, "M"), (1e3, "k")):
        if value >= 0.9995 * unit:
            return f"{value / unit:.0f}{name}"
    return "" if math.isnan(value) else f"{value:.{2 if abs(value) < 1 else 3}g}"


def tick(value, _=None):
    return f"{value:g}" if abs(value) < 1e4 else short(value)


def rows_of(panel, table):
    return [row for row in table if ("where" not in panel or row[panel["where"]] == panel["is"])
            and ("label" not in panel or row[panel["label"]])]


def style_of(families):
    """Colour, mark and dashes of each series: of its family, or one after the other."""
    styles, members = {}, {}
    for name, family in families.items():
        colour, mark = FAMILIES.get(family) or list(FAMILIES.values())[len(members) % len(FAMILIES)]
        members.setdefault(family, []).append(name)
        styles[name] = (colour, mark, DASHES[(len(members[family]) - 1) % len(DASHES)])
    return styles


def overlaps(boxes, others, weights):
    """The weighed area that each box has in common with others; boxes are rows of x0 y0 x1 y1."""
    both = np.minimum(boxes[:, None, 2:], others[None, :, 2:]) - np.maximum(boxes[:, None, :2], others[None, :, :2])
    return (both.clip(0).prod(axis=2) * weights).sum(axis=1)


def label_points(axes, labels, bars, size):
    """Names beside points: each in the free place that is nearest, with a line to it from afar."""
    renderer = axes.figure.canvas.get_renderer()
    spots = axes.transData.transform([point for point, _, _ in labels])
    ends = axes.transData.transform(np.reshape(bars, (-1, 2))).reshape(-1, 4)
    fixed = np.vstack([np.hstack([spots - 4, spots + 4]), ends + [-1, -1, 1, 1]])
    weights = np.repeat([3, 0.3], [len(spots), len(ends)])
    away, turn = (grid.ravel() for grid in np.meshgrid([6, 11, 18, 26, 36, 48, 62], np.arange(16) * np.pi / 8))
    offsets, places, costs = [], [], []
    for spot, (point, text, weight) in zip(spots, labels):
        note = axes.annotate(text, point, size=size, weight=weight)
        extent = np.array(note.get_window_extent(renderer).size)
        note.remove()
        offset = np.stack([np.cos(turn) * (away + extent[0] / 2), np.sin(turn) * (0.8 * away + extent[1] / 2)], axis=1)
        place = np.hstack([spot + offset - extent / 2, spot + offset + extent / 2])
        inside = overlaps(place, np.array([axes.get_window_extent(renderer).extents]), 1)
        offsets.append(offset)
        places.append(place)
        costs.append(overlaps(place, fixed, weights) + 1.2 * away + 9 * (extent.prod() - inside))
    chosen = list(map(np.argmin, costs))
    for i in list(range(len(labels))) * 4:
        others = np.array([places[k][chosen[k]] for k in range(len(labels)) if k != i]).reshape(-1, 4)
        chosen[i] = np.argmin(costs[i] + overlaps(places[i], others, 3))
    for i, (point, text, weight) in enumerate(labels):
        axes.annotate(text, point, offsets[i][chosen[i]], textcoords="offset points", ha="center", va="center",
                      size=size, color=INK, weight=weight, arrowprops={
                          "arrowstyle": "-", "lw": 0.5, "color": GREY} if away[chosen[i]] > 11 else None)


def draw_points(axes, panel, rows, size, everything):
    """Returns what to do when the layout is known. The x axis fits the rows of all panels."""
    styles = style_of({row[panel["series"]]: row[panel["family"]] for row in rows})
    values = [value for row in everything for key in ("x", "xupper") if (value := number(row, panel[key])) > 0] or [1]
    edge, most = 10 ** math.floor(math.log10(min(values))), max(values)
    # Zero has a place of its own at the left.
    has_none = any(number(row, panel["x"]) == 0 for row in everything)
    none = edge / (10 * most / edge) ** 0.15
    points, bars = [], []
    for row in rows:
        colour, mark, _ = styles[row[panel["series"]]]
        x, y = number(row, panel["x"]) or none, number(row, panel["y"])
        left, right, low, high = (number(row, panel[key]) for key in ("xlower", "xupper", "lower", "upper"))
        left = max(left, edge) if x > none else none
        bars += [((left, y), (right, y)), ((x, low), (x, high))]
        axes.plot([left, right], [y, y], color=colour, lw=0.7, alpha=0.6)
        axes.plot([x, x], [low, high], color=colour, lw=1)
        axes.plot([x], [y], mark, color=colour, ms=5.5, mec="white", mew=0.4, zorder=3)
        text = row[panel["label"]] + ("\n(disturbed)" if row["disturbed"] else "")
        points.append(((x, y), text, "bold" if row[panel["family"]] == "ours" else "normal"))
    if "front" in panel and not any(row["disturbed"] for row in rows):
        front = []
        for (x, y), _, _ in sorted(points, key=lambda one: (one[0][0], -one[0][1])):
            if not front or y > front[-1][1]:
                front += [(x, front[-1][1] if front else y), (x, y)]
        front.append((2 * most, front[-1][1]))
        axes.plot(*zip(*front), color="#C4C4C4", lw=3, zorder=1)
        axes.annotate(panel["front"], front[-1], (-2, 3), textcoords="offset points", ha="right", size=size, color=GREY)
        bars += zip(front, front[1:])
    axes.set(xscale="log", yscale="log", xlim=(none / (edge / none) ** 0.6 if has_none else edge, 2 * most))
    ticks = [edge * 10.0 ** i for i in range(1 + int(math.log10(2 * most / edge)))]
    ticks = ticks[::-2][::-1] if len(ticks) > 5 else ticks
    if has_none:
        axes.axvspan(axes.get_xlim()[0], (none * edge) ** 0.5, color="#EFEFEF", lw=0, zorder=0)
    axes.set_xticks([none] * has_none + ticks, ["none\nseen"] * has_none + [tick(value) for value in ticks])
    axes.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axes.yaxis.set_major_formatter(tick)
    axes.minorticks_off()
    axes.margins(y=0.12)
    axes.grid(axis="y", color="#E8E8E8", lw=0.5)
    return lambda: label_points(axes, points, bars, size)


def draw_lines(axes, panel, rows, size, _):
    """Returns what to do when the layout is known."""
    curves = {}
    for row in rows:
        curves.setdefault(row[panel["series"]], []).append(row)
    styles = style_of({name: curve[0].get(panel.get("family"), name) for name, curve in curves.items()})
    values = [number(row, panel["y"]) for row in rows]
    above = [value for value in values if value > 0]
    if above and max(above) > 30 * min(above):
        axes.set_yscale("symlog", linthresh=min(above))
    else:
        axes.set_ylim(-0.04 * max(values), 1.15 * max(values) or 1)
    ends = []
    for name, curve in curves.items():
        colour, mark, dashes = styles[name]
        points = [(number(row, panel["x"]), number(row, panel["y"])) for row in curve]
        if panel.get("lower"):
            axes.fill_between([x for x, _ in points], *([number(row, panel[key]) for row in curve]
                              for key in ("lower", "upper")), color=colour, alpha=0.15, lw=0)
        axes.plot(*zip(*points), color=colour, ls=dashes, lw=1.3, marker=mark, ms=size / 4)
        for point, row in zip(points, curve):
            if row.get(panel.get("event")):
                axes.plot(*point, "*", color=colour, ms=size, mec=INK, mew=0.6, zorder=4)
                axes.annotate(row[panel["event"]], point, (0, 6), textcoords="offset points", ha="center", size=size)
        disturbed = 4 * sum(bool(row.get("disturbed")) for row in curve) > len(curve)
        ends.append((*points[-1], "~" * disturbed + name, colour))
    axes.yaxis.set_major_formatter(tick)
    axes.grid(color="#E8E8E8", lw=0.5)
    axes.margins(x=0.01)

    def name_ends():
        # Names at the right ends, moved apart.
        spots = sorted([axes.transData.transform(end[:2])[1], *end] for end in ends)
        for i, spot in enumerate(spots[1:]):
            spot[0] = max(spot[0], spots[i][0] + 1.25 * size)
        for i, spot in enumerate(spots[::-1]):
            spot[0] = min(spot[0], axes.get_window_extent().y1 - 1.25 * size * i)
        for height, x, y, name, colour in spots:
            place = (1.03, axes.transAxes.inverted().transform((0, height))[1])
            axes.annotate(name, (x, y), place, textcoords="axes fraction", va="center", size=size, color=INK,
                          arrowprops={"arrowstyle": "-", "lw": 0.8, "color": colour, "relpos": (0, 0.5), "shrinkA": 1,
                                      "shrinkB": 2})
    return name_ends


def draw_map(axes, panel, rows, size, _):
    """Methods are beside each other if they are `across`, else below each other."""
    down, method = panel["series"], panel["method"]
    families = {row[method]: row["family"] for row in rows}
    names = {key: list(dict.fromkeys(row[key] for row in rows)) for key in (panel["across"], down)}
    names[method].sort(key=lambda name: list(FAMILIES).index(families[name]))
    columns, lines = names[panel["across"]], names[down]
    for row in rows:
        value = number(row, panel["shade"])
        i, j = columns.index(row[panel["across"]]), lines.index(row[down])
        level = 0 if not value > 0 else 1 if value < 10 else min(6, int(math.log10(value)) + 1)
        axes.fill([i, i + 0.97, i + 0.97, i], [j, j, j + 0.94, j + 0.94], color=SHADES[level], lw=0)
        text = f"{value / 1e4:.0f}%" if panel.get("percent") and value >= 1e4 else short(value)
        if "number" in panel:
            text = f"{'~' * bool(row['disturbed'])}{short(number(row, panel['number']))}; {text if value else 'none'}"
        axes.text(i + 0.48, j + 0.5, text, ha="center", va="center", size=size, color="white" if level > 5 else INK)
    axes.set(xlim=(0, len(columns)), ylim=(len(lines), 0))
    axes.set_yticks([j + 0.48 for j in range(len(lines))], lines)
    axes.set_xticks([i + 0.48 for i in range(len(columns))], columns)
    axes.tick_params(length=0)
    axes.spines[:].set_visible(False)
    if down == method:
        axes.xaxis.tick_top()
        for j, name in enumerate(lines):
            axes.plot([-0.015] * 2, [j, j + 0.94], color=FAMILIES[families[name]][0], lw=3, clip_on=False)
        return
    # The family stands above its methods.
    strip = lambda name: re.sub("^(2007|Embree|rule) ", "", name)
    axes.set_xticks(axes.get_xticks(), map(strip, columns), rotation=90 if size < 7 else 35,
                    ha="center" if size < 7 else "right", rotation_mode="default" if size < 7 else "anchor")
    for family in dict.fromkeys(families[name] for name in columns):
        mine = [i for i, name in enumerate(columns) if families[name] == family]
        axes.plot([mine[0] + 0.05, mine[-1] + 0.91], [-0.12] * 2, color=FAMILIES[family][0], lw=2.5, clip_on=False)
        axes.text((mine[0] + mine[-1] + 1) / 2, -0.3, family.replace(" ", "\n"), ha="center", va="bottom", size=size)


def draw(spec, narrow):
    size = 6.2 if narrow else 9
    matplotlib.rcParams.update({
        "font.family": "DejaVu Sans", "font.size": size, "axes.titlesize": size + 0.6, "text.parse_math": False,
        "axes.titlelocation": "left", "axes.spines.top": False, "axes.spines.right": False, "axes.edgecolor": GREY,
        "axes.axisbelow": True, "xtick.color": INK, "ytick.color": INK, "xtick.labelsize": size,
        "ytick.labelsize": size, "svg.fonttype": "none", "svg.hashsalt": "morphray", "pdf.fonttype": 42})
    panels, table = spec["panels"], list(csv.DictReader(io.StringIO(spec["csv"])))
    rows = [rows_of(panel, table) for panel in panels]
    kind = panels[0]["kind"]
    series = {row[panel["series"]] for panel, some in zip(panels, rows) for row in some}
    width = 3.346 if narrow else 10  # inches
    across = len(panels) if kind == "points" and not narrow else 1
    down = math.ceil(len(panels) / across)
    each = {"points": 2.05 if narrow else 4.6, "lines": 1.5 if narrow else 2.2,
            "map": len(series) * (0.14 if narrow else 0.24) + (1.3 if "percent" in panels[0] else 0.5)}[kind]
    title = textwrap.wrap(spec["title"], int(width * 72 / (size + 2) / 0.57))
    height = down * each + size * 1.25 / 72 * 1.5 * len(title)
    figure = Figure(figsize=(width, height), dpi=72, layout="constrained")
    FigureCanvasAgg(figure)
    # Names of curves stand to their right.
    right = 0.68 * size / 72 * max(map(len, series), default=0) / width if kind == "lines" else 0
    figure.get_layout_engine().set(rect=(0, 0, 1 - right, 1))
    figure.suptitle("\n".join(title), x=0.01, ha="left", size=size + 2, weight="bold")
    grid = figure.subplots(down, across, squeeze=False, sharey=across > 1, sharex=kind == "lines").flat
    draw_panel = {"points": draw_points, "lines": draw_lines, "map": draw_map}[kind]
    when_laid_out = []
    for i, (axes, panel) in enumerate(zip(grid, panels)):
        axes.set(title="\n".join(filter(None, [panel.get("title"), panel.get("note")])),
                 xlabel=panel.get("xlabel", "") if across > 1 or i + 1 == len(panels) else "",
                 ylabel=panel.get("ylabel", "") if i % across == 0 else "")
        when_laid_out.append(draw_panel(axes, panel, rows[i], size, sum(rows, [])))
    figure.draw_without_rendering()
    figure.set_layout_engine("none")
    for finish in filter(None, when_laid_out):
        finish()
    return figure


def main(path, form, narrow=""):
    with open(path, encoding="utf-8") as file:
        spec = json.load(file)
    title, details = (spec[key].replace("\n", " ") for key in ("title", "details"))
    about = {"svg": {"Description": details, "Date": None}, "png": {},
             "pdf": {"Subject": details, "CreationDate": None}}[form]
    draw(spec, narrow).savefig(sys.stdout.buffer, format=form, metadata={"Title": title, **about}, dpi=144)


main(*sys.argv[1:])

# Draws panels below each other from a CSV file. report/plot.cpp sets by `gnuplot -e` the variables
# csv, format, width, panel_height and panels, and heads and foots lines of text: head1, head2, ... and
# foot1, ... Those of panel N end in N and may be missing:
#   kind       lines, points or map
#   title, xlabel, ylabel
#   x, y       names of columns
#   series     the column that tells curves apart, or names the rows of a map
#   where, is  only rows with this text in that column
#   lower, upper  columns of the ends of a light band, of points: of bars
#   xlower, xupper  columns of the ends of horizontal bars of points
#   family     the column whose names share a colour; without it each curve has one
#   hollow     points are hollow where this column is 0
#   logx       the base of a logarithmic axis
#   across, shade  columns of a map: names below, number and colour; digits after its point
set datafile separator comma
set datafile columnheaders
set encoding utf8
get(name) = exists(name.p) ? value(name.p) : ''
largest(a, b) = a > b ? a : b
# The colours of M. Okabe and K. Ito, Color Universal Design, 2008, without yellow, and two more.
colour(i) = word('#0072B2 #D55E00 #009E73 #CC79A7 #E69F00 #56B4E9 #000000 #7F7F7F #882255', (i - 1) % 9 + 1)
symbol(i) = int(word('7 5 9 13 11 15 2 1 3', (i - 1) % 9 + 1))
hollow_symbol(i) = int(word('6 4 8 12 10 14 2 1 3', (i - 1) % 9 + 1))

# Curve i is the rows with name i.
kept(i) = where eq '' || strcol(where) eq is
mine(i) = kept(i) && strcol(series) eq word(names, i)

# Zero has a place of its own on a logarithmic axis; of points with bars it is the left end.
huge = 1e300
zero_of(least, zeros) = zeros == 0 ? 0 : least < huge ? 0.3 * 10**floor(log10(least)) : 0.3
place(v, zero) = zero > 0 && v <= 0 ? zero : v
xof(i) = mine(i) ? place(column(xs), xzero) : NaN
yof(i, name) = mine(i) ? place(column(name), yzero) : NaN

# These collect names and ranges of rows. hues and marks: the numbers of a curve's colour and symbol.
array members[40]
find_family(f) = strstrt(families, '"'.f.'"') > 0 ? 0 : (families = families.' "'.f.'"', 0)
number_of(f) = sum [i = 1:words(families)] (word(families, i) eq f ? i : 0)
add_member(n) = (members[n] = members[n] + 1, hues = hues.' '.n, marks = marks.' '.members[n], 0)
add_name(s, f) = strstrt(names, '"'.s.'"') ? 0 : (names = names.' "'.s.'"', \
    longest = largest(longest, strlen(s)), find_family(f), add_member(number_of(f)))
# gnuplot reads these once beyond the last curve, for loops without a turn.
nth(list, i) = i > words(list) ? 1 : int(word(list, i))
hue(i) = colour(nth(hues, i))
mark(i) = nth(marks, i)
add_x(v) = v > 0 ? (xleast = v < xleast ? v : xleast, 0) : (xzeros = xzeros + 1, 0)
add_y(v) = v > 0 ? (yleast = v < yleast ? v : yleast, ymost = largest(v, ymost), 0) : (yzeros = yzeros + 1, 0)

# The colours of no wrong answer, up to 10 in a million, and so on (C. Brewer, M. Harrower.
# ColorBrewer, "YlOrBr". 2003).
array shades[7] = [0xF2F7FA, 0xFFF7BC, 0xFEE391, 0xFEC44F, 0xFE9929, 0xEC7014, 0xA63603]
level(v) = !(v > 0) ? 1 : v < 10 ? 2 : v >= 1e5 ? 7 : int(log10(v)) + 2
map_text(v) = v != v ? "" : v < 100 ? sprintf("%.".digits."f", v) : v < 1e3 ? sprintf("%.0f", v) : \
    v < 1e6 ? sprintf("%.0fk", v / 1e3) : sprintf("%.0fM", v / 1e6)

longest = 0
p = 1
kind = get('kind')
is_curve = kind eq 'lines' || kind eq 'points'
names = ''; families = ''; hues = ''; marks = ''
do for [i = 1:40] { members[i] = 0 }
do for [p = 1:panels] {
    name = get('series'); family = get('family') eq '' ? name : get('family')
    stats csv using (add_name(strcol(name), strcol(family))) nooutput
}
if (get('family') eq '') { marks = hues }
# Pixels: of a line of text, of what is above and below all panels, and between them.
line = 23.0
left = is_curve ? 105.0 : 9.0 * longest + 25
legend_columns = is_curve ? largest(1, int((width - 30) / (9.5 * longest + 30))) : 1
legend_rows = is_curve ? int(ceil(1.0 * words(names) / legend_columns)) : 0
above = line * (heads + legend_rows) + 65
below = line * foots + (is_curve ? 85 : 130)
between = 135.0
height = int(above + below + panels * panel_height + (panels - 1) * between)
if (format eq 'png') {
    # Points of 1/72 inch at 96 pixels an inch.
    set terminal pngcairo size width,height font 'Helvetica,12' background '#ffffff'
} else { if (format eq 'pdf') {
    set terminal pdfcairo size width / 96.0,height / 96.0 font 'Helvetica,12' background '#ffffff'
} else {
    set terminal svg size width,height font 'Helvetica,16' background '#ffffff'
} }
do for [i = 1:heads] {
    set label value('head'.i) at screen 15.0 / width, 1 - i * line / height left noenhanced
}
do for [i = 1:foots] {
    set label value('foot'.i) at screen 15.0 / width, ((foots - i) * line + 15) / height \
        left noenhanced tc rgb '#666666'
}
# The legend, of all panels.
do for [i = 1:words(names) * is_curve] {
    set label word(names, i) \
        at screen (20.0 + (i - 1) / legend_rows * ((width - 30) / legend_columns)) / width, \
        1 - ((heads + 1 + (i - 1) % legend_rows) * line + 5) / height \
        left offset character 1,-0.15 point lc rgb hue(i) pt symbol(mark(i)) ps 0.9 noenhanced
}
set multiplot layout panels,1 margins screen left / width,1 - 32.0 / width,below / height,1 - above / height \
    spacing screen 0,between / height
unset key
set format '%g'
set border 3 lc rgb '#888888'
set tics nomirror out scale 0.5 tc rgb '#333333'
set style fill solid noborder
do for [p = 1:panels] {
    kind = get('kind'); xs = get('x'); ycol = get('y'); series = get('series')
    where = get('where'); is = get('is'); lower = get('lower'); upper = get('upper')
    unset logscale; set xtics auto norotate; set ytics auto; set autoscale
    set grid back lt 1 lw 1 lc rgb '#e4e4e4'
    set title get('title') noenhanced
    xlabel = get('xlabel'); ylabel = get('ylabel')
    if (kind eq 'map') {
        across = get('across'); shade = get('shade'); digits = get('digits') eq '' ? '0' : get('digits')
        unset grid; set yrange [*:*] reverse; set ytics noenhanced; set xtics noenhanced rotate by 30 right
        plot csv using (column(xs)):(column(ycol)):(column(xs) - 0.48):(column(xs) + 0.48): \
            (column(ycol) - 0.46):(column(ycol) + 0.46):(shades[level(column(shade))]): \
            xtic(strcol(across)):ytic(strcol(series)) with boxxyerror lc rgb variable notitle, \
            csv using (column(xs)):(column(ycol)):(map_text(column(shade))): \
            (level(column(shade)) > 6 ? 0xFFFFFF : 0x333333) with labels tc rgb variable notitle
    }
    if (kind eq 'lines' || kind eq 'points') {
        xleast = huge; yleast = huge; ymost = 0; xzeros = 0; yzeros = 0
        xlower = get('xlower'); xupper = get('xupper'); hollow = get('hollow')
        stats csv using (kept(0) ? add_x(column(xs)) : 0) nooutput
        stats csv using (kept(0) ? add_y(column(ycol)) : 0) nooutput
        logx = get('logx')
        xzero = logx eq '' ? 0 : xlower eq '' ? zero_of(xleast, xzeros) : xleast / 10
        yzero = ymost > 30 * yleast ? zero_of(yleast, yzeros) : 0
        set format x '%g'
        if (logx ne '') { set logscale x int(logx); set format x '10^{%L}' }
        if (ymost > 30 * yleast) { set logscale y; ylabel = ylabel.', logarithmic' } else { set yrange [0:*] }
        set xlabel xlabel noenhanced
        set ylabel ylabel noenhanced
        if (xlower ne '') { set xrange [xzero:*] }
        if (xlower eq '' && xzero > 0) { set xrange [xzero / 2:3 * xzero<*]; set xtics add ('none' xzero) }
        if (yzero > 0) { set yrange [yzero / 2:*]; set ytics add ('none' yzero) }
        n = words(names)
        bands = lower eq '' || kind eq 'points' ? 0 : n
        lines = kind eq 'lines' ? n : 0
        bars = xlower eq '' ? 0 : n
        plot for [i = 1:bands] csv using (xof(i)):(yof(i, lower)):(yof(i, upper)) \
                with filledcurves lc rgb hue(i) fs transparent solid 0.15 noborder notitle, \
            for [i = 1:lines] csv using (xof(i)):(yof(i, ycol)) with linespoints \
                lc rgb hue(i) lw 2 pt symbol(mark(i)) ps 0.8 notitle, \
            for [i = 1:bars] csv using (xof(i)):(yof(i, ycol)): \
                (largest(column(xlower), xzero)):(column(xupper)):(column(lower)):(column(upper)) \
                with xyerrorbars lc rgb hue(i) lw 0.7 pt 0 notitle, \
            for [i = lines + 1:n] csv using (xof(i)):(yof(i, ycol)): \
                (hollow ne '' && column(hollow) == 0 ? hollow_symbol(mark(i)) : symbol(mark(i))) \
                with points lc rgb hue(i) pt variable ps 1 notitle
    }
    unset label
}
unset multiplot

# Draws a figure from a CSV file. common/report/plot.cpp sets by `gnuplot -e` the variables csv, format,
# title, footer, width, height, columns and panels. Those of panel N end in N and may be missing:
#   kind       lines, points or map
#   title, xlabel, ylabel
#   x, y       names of columns
#   series     the column that tells curves apart, or names the rows of a map
#   where, is  only rows with this text in that column
#   ring       points with yes in that column get a ring
#   least      the column of the lower end of a bar at each point
#   logx       the base of a logarithmic axis
#   across, shade, note  columns of a map: names below, colour, second line
set datafile separator comma
set datafile columnheaders
set encoding utf8
if (format eq 'png') {
    # Points of 1/72 inch at 96 pixels an inch.
    set terminal pngcairo size width,height font 'Helvetica,10.5' background '#ffffff'
} else {
    set terminal svg size width,height font 'Helvetica,14' background '#ffffff'
}

get(name) = exists(name.p) ? value(name.p) : ''
largest(a, b) = a > b ? a : b
# The colours of M. Okabe and K. Ito, Color Universal Design, 2008, without yellow, and two more.
colour(i) = word('#0072B2 #D55E00 #009E73 #CC79A7 #E69F00 #56B4E9 #000000 #7F7F7F #882255', (i - 1) % 9 + 1)
symbol(i) = int(word('7 5 9 13 11 6 4', (i - 1) % 7 + 1))

# Curve i is the rows with name i.
kept(i) = where eq '' || strcol(where) eq is
mine(i) = kept(i) && strcol(series) eq word(names, i)

# Zero has a place of its own on a logarithmic axis.
huge = 1e300
zero_of(least, zeros) = zeros == 0 ? 0 : least < huge ? 0.3 * 10**floor(log10(least)) : 0.3
place(v, zero) = zero > 0 && v <= 0 ? zero : v
xof(i) = mine(i) ? place(column(xs), xzero) : NaN
yof(i, name) = mine(i) ? place(column(name), yzero) : NaN

# These collect names and ranges of rows.
add_name(s) = strstrt(names, '"'.s.'"') ? 0 : (names = names.' "'.s.'"', longest = largest(longest, strlen(s)), 0)
add_x(v) = v > 0 ? (xleast = v < xleast ? v : xleast, 0) : (xzeros = xzeros + 1, 0)
add_y(v) = v > 0 ? (yleast = v < yleast ? v : yleast, ymost = largest(v, ymost), 0) : (yzeros = yzeros + 1, 0)

# The colours of no wrong answer, up to 10 in a million, and so on (C. Brewer, M. Harrower.
# ColorBrewer, "YlOrBr". 2003).
array shades[7] = [0xF2F7FA, 0xFFF7BC, 0xFEE391, 0xFEC44F, 0xFE9929, 0xEC7014, 0xA63603]
level(v) = v <= 0 ? 1 : v < 10 ? 2 : v >= 1e5 ? 7 : int(log10(v)) + 2
map_text(v) = sprintf("%.0f\n%.2g", v, column(note))

longest = 0
p = 1
kind = get('kind')
is_curve = kind eq 'lines' || kind eq 'points'
do for [p = 1:panels] {
    names = ''; name = get('series')
    stats csv using (add_name(strcol(name))) nooutput
}
text = 8.0 * longest + 85
if (is_curve) { left = 95; right = text } else { left = text; right = 30 }
below = kind eq 'map' ? 140.0 : 100.0
set label title at screen 0, screen 1 offset character 2, character -1.2 left noenhanced
set label footer at screen 0, screen 0 offset character 2, character 1 left noenhanced tc rgb '#666666'
set multiplot layout (panels + columns - 1) / columns,columns \
    margins screen 1.0 * left / width,1 - 1.0 * right / width,below / height,1 - 70.0 / height \
    spacing screen 105.0 / width,110.0 / height
set format '%g'
set border 3 lc rgb '#888888'
set tics nomirror out scale 0.5 tc rgb '#333333'
set style fill solid noborder
do for [p = 1:panels] {
    kind = get('kind'); xs = get('x'); ycol = get('y'); series = get('series')
    where = get('where'); is = get('is'); ring = get('ring'); least = get('least')
    unset logscale; set xtics auto norotate; set ytics auto; set autoscale; unset key
    set grid back lt 1 lw 1 lc rgb '#e4e4e4'
    set title get('title') noenhanced
    set xlabel get('xlabel') noenhanced
    set ylabel get('ylabel') noenhanced
    if (kind eq 'map') {
        across = get('across'); shade = get('shade'); note = get('note')
        unset grid; set yrange [*:*] reverse; set ytics noenhanced; set xtics noenhanced rotate by 30 right
        plot csv using (column(xs)):(column(ycol)):(column(xs) - 0.48):(column(xs) + 0.48): \
            (column(ycol) - 0.46):(column(ycol) + 0.46):(shades[level(column(shade))]): \
            xtic(strcol(across)):ytic(strcol(series)) with boxxyerror lc rgb variable notitle, \
            csv using (column(xs)):(column(ycol)):(map_text(column(shade))): \
            (level(column(shade)) > 6 ? 0xFFFFFF : 0x333333) with labels offset 0,0.5 tc rgb variable notitle
    }
    if (kind eq 'lines' || kind eq 'points') {
        names = ''; xleast = huge; yleast = huge; ymost = 0; xzeros = 0; yzeros = 0
        stats csv using (kept(0) ? add_name(strcol(series)) + add_x(column(xs)) : 0) nooutput
        stats csv using (kept(0) ? add_y(column(ycol)) : 0) nooutput
        logx = get('logx')
        xzero = logx eq '' ? 0 : zero_of(xleast, xzeros)
        yzero = ymost > 30 * yleast ? zero_of(yleast, yzeros) : 0
        if (logx ne '') { set logscale x int(logx) }
        if (ymost > 30 * yleast) { set logscale y } else { set yrange [0:*] }
        if (xzero > 0) { set xrange [xzero / 2:3 * xzero<*]; set xtics add ('none' xzero) }
        if (yzero > 0) { set yrange [yzero / 2:*]; set ytics add ('none' yzero) }
        # One legend on the right of each row.
        if (p % columns == 0 || p == panels) { set key at graph 1.02, graph 1 left top Left reverse noenhanced }
        n = words(names)
        ranges = least eq '' ? 0 : n
        lines = kind eq 'lines' ? n : 0
        plot for [i = 1:ranges] csv using (xof(i)):(yof(i, ycol)):(yof(i, least)):(yof(i, ycol)) \
                with yerrorbars pt -1 lw 1 lc rgb colour(i) notitle, \
            for [i = 1:lines] csv using (xof(i)):(yof(i, ycol)) with linespoints \
                lc rgb colour(i) lw 2 pt symbol(i) ps 0.8 title word(names, i), \
            for [i = lines + 1:n] csv using (xof(i)):(yof(i, ycol)) with points \
                lc rgb colour(i) pt symbol(i) ps 1.2 title word(names, i), \
            csv using (ring ne '' && kept(0) && strcol(ring) eq 'yes' ? place(column(xs), xzero) : NaN): \
                (place(column(ycol), yzero)) with points pt 6 ps 1.8 lc rgb '#000000' notitle
    }
    unset label
}
unset multiplot

// A frame of `size` along z with rounded corners (roundness 0..1), whose sides lean in or out towards the top
// (taper 0..2), hollowed (onion 0..1), bent into an arc towards -x (bulge 0..1), then grown by `dilation`.
module superfrustum(size, roundness, dilation, taper, bulge, onion) {
    m = min(size.x, size.y) / 2;
    h = size.z / 2;
    hollow = max(1, taper) * m * onion > dilation;
    flare = max(0, taper - 1) * m + dilation;
    bend = 90 * bulge;
    arc_radius = bulge > 0 ? h / sin(bend) : 0;
    largest = max(max(size.x, size.y) / 2 + flare, bulge > 0 ? arc_radius : 0);
    corner_steps = steps(roundness * m + flare, 90);

    // Facets of a turn about this radius: as far off the circle as $fn facets are off the largest one.
    function steps(radius, degrees) = ceil($fn * abs(degrees) / 360 * sqrt(radius / largest));
    function between(first, last, n) = [for (i = [0 : n]) first + (n > 0 ? i / n : 0.5) * (last - first)];

    // The wall's outline as [distance from the frame's sides, height], rounded by the dilation.
    function edge(place, first, last) =
        [for (a = between(first, last, steps(dilation, last - first))) place + dilation * [cos(a), sin(a)]];
    lean = atan2((1 - taper) * m, size.z);
    inner_lean = 180 + atan2((1 - taper) * m * onion, size.z);
    outer = concat(edge([0, -h], -90, lean), edge([(taper - 1) * m, h], lean, 90));
    inner = concat(edge([(taper * onion - 1) * m, h], 90, inner_lean), edge([(onion - 1) * m, -h], inner_lean, 270));
    loop = hollow ? concat(outer, inner, [outer[0]]) : outer;
    places = [
        for (i = [0 : len(loop) - 1])
            let (sharp = i > 0 ? (-roundness * m - loop[i - 1].x) / (loop[i].x - loop[i - 1].x) : 0)
            each [if (sharp > 0 && sharp < 1) loop[i - 1] + sharp * (loop[i] - loop[i - 1]), loop[i]]
    ];
    outline = [
        for (i = [1 : len(places) - 1])
            let (rise = abs(places[i].y - places[i - 1].y) / max(size.z, dilation))
            let (n = max(1, steps(arc_radius, 2 * bend * rise)))
            for (j = [0 : n - 1]) places[i - 1] + j / n * (places[i] - places[i - 1]),
        if (!hollow) places[len(places) - 1]
    ];

    // One ring of points around the frame for each place of the outline.
    function ring(place) =
        let (radius = max(roundness * m + place.x, 0))
        let (x = max(size.x / 2 + place.x - radius, 0), y = max(size.y / 2 + place.x - radius, 0))
        [
            for (quarter = [0 : 3], a = between(90 * quarter, 90 * quarter + 90, corner_steps))
                bent([
                    x * [1, -1, -1, 1][quarter] + radius * cos(a),
                    y * [1, 1, -1, -1][quarter] + radius * sin(a),
                    place.y
                ])
        ];
    function bent(p) = bulge == 0 ? p :
        let (z = max(-h, min(h, p.z)), turn = bend * z / h, beyond = p.z - z, radius = arc_radius - p.x)
        [
            h / tan(bend) - radius * cos(turn) + beyond * sin(turn),
            p.y,
            radius * sin(turn) + beyond * cos(turn)
        ];

    around = 4 * (corner_steps + 1);
    rings = len(outline);
    function at(i, j) = (i % rings) * around + j % around;
    sides = [
        for (i = [0 : rings - (hollow ? 1 : 2)], j = [0 : around - 1])
            each [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]]
    ];
    ends = hollow ? [] : [
        [for (j = [0 : around - 1]) j],
        [for (j = [around - 1 : -1 : 0]) at(rings - 1, j)]
    ];
    polyhedron([for (place = outline) each ring(place)], concat(sides, ends));
}

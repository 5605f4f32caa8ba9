// A round rod, or a tube whose wall has this thickness, flat at its ends. Its path is straight from corner to corner
// and takes those between its ends in bends of this radius, or of one each. One polyhedron: the union
// of cylinders and turned circles takes OpenSCAD a hundred times as long.
module pipe_along(corners, bends, radius, thickness = 0) {
    last = len(corners) - 1;
    function unit(v) = v / norm(v);
    function way(i) = unit(corners[i + 1] - corners[i]);

    // Places along the path, and its direction there.
    function bend_places(i) =
        let (bend = is_list(bends) ? bends[i - 1] : bends, before = way(i - 1), after = way(i))
        let (turn = atan2(norm(cross(before, after)), before * after))
        let (inwards = unit(after - (after * before) * before), steps = ceil($fn * turn / 360))
        let (centre = corners[i] - bend * tan(turn / 2) * before + bend * inwards)
        [
            for (k = [0 : steps])
                let (t = turn * k / steps)
                [centre + bend * (sin(t) * before - cos(t) * inwards), cos(t) * before + sin(t) * inwards]
        ];
    path = [
        [corners[0], way(0)],
        for (i = [1 : 1 : last - 1]) each bend_places(i),
        [corners[last], way(last - 1)]
    ];
    places = [
        for (i = [0 : len(path) - 1]) if (i == 0 || norm(path[i][0] - path[i - 1][0]) > radius / 1e5) path[i]
    ];
    ends = len(places) - 1;

    // A direction across each place, turned as the path is.
    function turned(v, before, after) =
        let (axis = cross(before, after))
        (before * after) * v + cross(axis, v) + (axis * v) / (1 + before * after) * axis;
    least = min([for (v = way(0)) abs(v)]);
    first = unit(cross(way(0), [for (v = way(0)) abs(v) == least ? 1 : 0]));
    function next(v, i) = i > ends ? v : turned(v, places[i - 1][1], places[i][1]);
    across = [for (i = 0, v = first; i <= ends; i = i + 1, v = next(v, i)) v];
    function ring(i, r) =
        let (x = r * across[i], y = r * cross(places[i][1], across[i]))
        [for (j = [0 : $fn - 1]) places[i][0] + cos(360 * j / $fn) * x + sin(360 * j / $fn) * y];

    outer = [for (i = [0 : ends]) each ring(i, radius)];
    inner = thickness > 0 ? [for (i = [ends : -1 : 0]) each ring(i, radius - thickness)] : [];
    rings = len(concat(outer, inner)) / $fn;
    function at(i, j) = (i % rings) * $fn + j % $fn;
    sides = [
        for (i = [0 : rings - (thickness > 0 ? 1 : 2)], j = [0 : $fn - 1])
            each [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]]
    ];
    lids = thickness > 0 ? [] : [[for (j = [0 : $fn - 1]) j], [for (j = [$fn - 1 : -1 : 0]) at(ends, j)]];
    polyhedron(concat(outer, inner), concat(sides, lids));
}

struct Part {
    vec3 translation;
    vec4 rotation;    // unit quaternion (x, y, z, w), local to world
    vec3 size;        // full extents before dilation
    float roundness;  // corner radius of the cross-section, a fraction of its smaller half extent: 0..1
    float dilation;   // offset of the whole surface outwards
    float taper;      // width of the top: 1 a prism, 0 a point or ridge, 2 a flare
    float bulge;      // bends the axis into an arc of half angle bulge * pi/2, towards -x: 0..1
    float onion;      // hollows it along the axis: 0 solid, towards 1 a thin tube
    float blend;      // width over which the part melts into what comes before it
};

// As exact as the arc tangent.
float sine(float x) {  // 0..pi/2
    float s = x * x;
    return x * (1.0 - s / 6.0 * (1.0 - s / 20.0 * (1.0 - s / 42.0 * (1.0 - s / 72.0 * (1.0 - s / 110.0)))));
}

float part_sdf(vec3 p, Part f) {
    vec3 v = p - f.translation, axis = -f.rotation.xyz;
    v += 2.0 * cross(axis, cross(axis, v) + f.rotation.w * v);
    float m = min(f.size.x, f.size.y) / 2.0;
    float h = f.size.z / 2.0 + 1e-12;  // no edge has length zero
    float theta = f.bulge * HALF_PI;
    vec2 across_along = f.bulge > 0.0 ? bend(v.x, v.z, h, vec3(theta, sine(theta), sine(HALF_PI - theta))) : v.xz;
    float q = cross_section(vec2(across_along.x, v.y), f.size.xy / 2.0, f.roundness * m);
    vec3 edges = m * vec3(f.taper - 1.0, f.onion - 1.0, f.taper * f.onion - 1.0);
    bool closed = max(f.taper, 1.0) * m * f.onion <= f.dilation;
    return profile(vec2(q, across_along.y), h, edges, closed) - f.dilation;
}

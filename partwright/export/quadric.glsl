struct Quadric { vec3 translation; vec4 rotation; mat3 square; vec3 linear; float constant, fall, rise, blend; };

// A lower bound of the distance, exact for planes, spheres and round cylinders (Taubin 1994).
float quadric_sdf(vec3 p, Quadric f) {
    vec3 v = p - f.translation, axis = -f.rotation.xyz;
    v += 2.0 * cross(axis, cross(axis, v) + f.rotation.w * v);
    vec3 bent = f.square * v;
    float value = dot(bent + f.linear, v) + f.constant;
    float steep = length(2.0 * bent + f.linear), size = abs(value);
    float turn = (value < 0.0 ? f.rise : f.fall) * size;
    float reach = 2.0 * size / max(steep + sqrt(max(steep * steep + 4.0 * turn, 0.0)), 1e-18);
    return value < 0.0 ? -reach : reach;
}

struct Quadric { vec3 translation; vec4 rotation; mat3 square; vec3 linear; float constant, fall, rise, blend; };

float quadric_sdf(vec3 p, Quadric f) {
    vec3 v = p - f.translation, axis = -f.rotation.xyz;
    v += 2.0 * cross(axis, cross(axis, v) + f.rotation.w * v);
    vec3 bent = f.square * v;
    float value = dot(bent + f.linear, v) + f.constant;
    return quadric_reach(value, length(2.0 * bent + f.linear), f.fall, f.rise);
}

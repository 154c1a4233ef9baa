/* SPDX-License-Identifier: MIT
 * shaders.c - the light, the sky, and solid things, in GLSL.
 */
#include "render/shaders.h"

/* Sources stay readable as code; the preprocessor makes strings of them (each under 4095
 * characters). */
#define GLSL(...) #__VA_ARGS__

/* clang-format off */

const char jsl_shader_frame[] = GLSL(
layout(std140) uniform Frame {
    mat4 camera;
    mat4 shadow;
    mat4 shadow_clip;
    vec4 right;
    vec4 up;
    vec4 forward;
    vec4 sun;
    vec4 sunlight;
    vec4 zenith;
    vec4 horizon;
    vec4 bounce;
    vec4 eye;
    vec4 screen;
    vec4 cloud;
    vec4 grid;
};
);

/* The tone curve is a rational fit of a film's response, display gamma included (Hejl and
 * Burgess-Dawson, in Hable 2010, "Uncharted 2: HDR lighting").
 * Ambient light is a hemisphere: sky above, what the ground returns below. Highlights: Blinn
 * 1977. */
const char jsl_shader_light[] = GLSL(
uniform sampler2DShadow shadow_map;

vec3 tone(vec3 c) {
    c = max(c - 0.004, 0.0);
    return c * (6.2 * c + 0.5) / (c * (6.2 * c + 1.7) + 0.06);
}

vec3 sky(vec3 d) {
    float h = max(d.z, 0.0);
    float t = 1.0 - h;
    t *= t;
    t = 1.0 - t * t * t;
    float s = max(dot(d, sun.xyz), 0.0);
    s *= s;
    s *= s;
    return mix(horizon.rgb, zenith.rgb, t) + sunlight.rgb * (0.06 * s);
}

float sunlit(vec3 p, vec3 n) {
    vec3 q = (shadow * vec4(p + n * (1.5 * sun.w), 1.0)).xyz;
    q.z = min(q.z, 1.0);
    vec2 texel = 1.0 / vec2(textureSize(shadow_map, 0));
    float s = texture(shadow_map, vec3(q.xy + texel * vec2(-1.0, -1.0), q.z));
    s += texture(shadow_map, vec3(q.xy + texel * vec2(1.0, -1.0), q.z));
    s += texture(shadow_map, vec3(q.xy + texel * vec2(1.0, 1.0), q.z));
    s += texture(shadow_map, vec3(q.xy + texel * vec2(-1.0, 1.0), q.z));
    return mix(1.0, 0.25 * s, sunlight.w);
}

vec3 diffuse(vec3 albedo, vec3 n, float light, float open) {
    vec3 above = mix(horizon.rgb, zenith.rgb, 0.45) * vec3(0.78, 0.74, 0.68);
    vec3 ambient = mix(bounce.rgb, above, n.z * 0.5 + 0.5);
    return albedo * (sunlight.rgb * (max(dot(n, sun.xyz), 0.0) * light) + ambient * open);
}

vec3 shine(vec3 n, vec3 p, float light, float open) {
    vec3 v = -normalize(p);
    float s = max(dot(n, normalize(v + sun.xyz)), 0.0);
    s *= s;
    s *= s;
    s *= s;
    s *= s;
    s *= s * s;
    float rim = 1.0 - max(dot(n, v), 0.0);
    rim *= rim;
    rim *= rim;
    return sunlight.rgb * (s * light) + horizon.rgb * (0.25 * rim * open * (n.z * 0.5 + 0.5));
}

vec3 haze(vec3 c, vec3 p) {
    float d = max(length(p), 1e-9);
    float t = d * eye.w;
    vec3 far = p / d;
    return mix(sky(vec3(far.xy, max(far.z, 0.0))), c, exp(-t * t));
}
);

/* One vertex: a point of a unit box or a pole, and a direction. Scaled point + radius * direction
 * gives boxes, spheres and capsules alike. */
const char jsl_shader_body_vs[] = GLSL(
layout(location = 0) in vec3 vertex;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec3 centre;
layout(location = 3) in vec4 turn;
layout(location = 4) in vec4 size;
layout(location = 5) in vec4 rgba;
out vec3 local;
out vec3 local_normal;
out vec3 place;
flat out vec4 turned;
flat out vec4 sized;
flat out vec4 color;

vec3 rotate(vec4 q, vec3 v) {
    vec3 t = 2.0 * cross(q.xyz, v);
    return v + q.w * t + cross(q.xyz, t);
}

void main() {
    local = vertex * size.xyz + normal * size.w;
    local_normal = normal;
    place = centre + rotate(turn, local);
    turned = turn;
    sized = size;
    color = vec4(pow(rgba.rgb, vec3(2.2)), rgba.a);
    gl_Position = camera * vec4(place, 1.0);
}
);

/* A box gets rounded-looking edges (its normal bends towards the neighbour face) and a thin dark
 * line on them, so that equal boxes in a pile stay apart for the eye. Round things get faint
 * octants, so that their spin shows. */
const char jsl_shader_body_fs[] = GLSL(
in vec3 local;
in vec3 local_normal;
in vec3 place;
flat in vec4 turned;
flat in vec4 sized;
flat in vec4 color;
layout(location = 0) out vec4 result;

vec3 rotate(vec4 q, vec3 v) {
    vec3 t = 2.0 * cross(q.xyz, v);
    return v + q.w * t + cross(q.xyz, t);
}

void main() {
    float pixel = length(place) * screen.z;
    float shade = 1.0;
    vec3 n = local_normal;
    if (BOX) {
        float small = min(sized.x, min(sized.y, sized.z));
        vec3 inside = sized.xyz - abs(local) + abs(local_normal) * 1e6;
        float bevel = max(0.07 * small, 1.2 * pixel);
        vec3 bend = clamp(1.0 - inside / bevel, 0.0, 1.0);
        n = normalize(n + sign(local) * bend * bend * 0.9 * clamp(small / (6.0 * pixel), 0.0, 1.0));
        float edge = min(inside.x, min(inside.y, inside.z));
        float line = max(0.018 * small, 0.7 * pixel);
        float seen = clamp(small / (5.0 * pixel) - 0.2, 0.0, 1.0);
        shade = 1.0 - 0.42 * seen * (1.0 - smoothstep(line, line + max(line, 1.2 * pixel), edge));
        shade *= 1.0 - 0.10 * seen * (1.0 - clamp(edge / (0.55 * small), 0.0, 1.0));
    } else {
        n = normalize(n);
        vec3 wide = max(vec3(pixel / max(sized.w, pixel)), 0.004) * 1.3;
        vec3 side = clamp(n / wide, -1.0, 1.0);
        shade = 0.94 + 0.06 * side.x * side.y * side.z;
    }
    vec3 world = rotate(turned, n);
    float light = sunlit(place, rotate(turned, local_normal));
    float open = 0.80 + 0.20 * world.z;
    vec3 c = diffuse(color.rgb * shade, world, light, open);
    c += (BOX ? 0.10 : 0.22) * shine(world, place, light, open);
    result = vec4(tone(haze(c, place)), color.a);
}
);

const char jsl_shader_none_fs[] = GLSL(
void main() {}
);

/* A bird in units of its length, x forward, y left, z up. beat is how far out on the wing a vertex
 * is, with the sign of its side: the wing turns about the shoulder, its tip later than its root. */
const char jsl_shader_bird_vs[] = GLSL(
layout(location = 0) in vec3 vertex;
layout(location = 1) in vec2 beat;
layout(location = 2) in vec4 centre;
layout(location = 3) in vec4 ahead;
layout(location = 4) in vec4 above;
layout(location = 5) in vec4 rgba;
out vec3 place;
out float tint;
flat out vec4 color;

void main() {
    float out_ = abs(beat.x);
    float angle = above.w * (sin(ahead.w - 0.9 * out_) * 0.85 + 0.18) * step(0.01, out_);
    vec3 v = vertex;
    float reach = abs(v.y);
    v.y = sign(v.y) * reach * cos(angle);
    v.z += reach * sin(angle);
    vec3 left = cross(above.xyz, ahead.xyz);
    place = centre.xyz + centre.w * (v.x * ahead.xyz + v.y * left + v.z * above.xyz);
    tint = beat.y;
    color = vec4(pow(rgba.rgb, vec3(2.2)), rgba.a);
    gl_Position = camera * vec4(place, 1.0);
}
);

const char jsl_shader_bird_fs[] = GLSL(
in vec3 place;
in float tint;
flat in vec4 color;
layout(location = 0) out vec4 result;

void main() {
    vec3 n = normalize(cross(dFdx(place), dFdy(place)) + vec3(1e-12, 0.0, 0.0));
    n = dot(n, place) > 0.0 ? -n : n;
    float light = max(dot(n, sun.xyz), 0.0);
    float through = max(dot(-n, sun.xyz), 0.0) * 0.25;
    vec3 c = diffuse(color.rgb * tint, n, 1.0, 0.9);
    c += color.rgb * tint * sunlight.rgb * (through + 0.05 * light);
    result = vec4(tone(haze(c, place)), color.a);
}
);

/* clang-format on */

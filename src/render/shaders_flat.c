/* SPDX-License-Identifier: MIT
 * shaders_flat.c - ground, sky, particles and what is done to whole pictures, in GLSL.
 */
#include "render/shaders.h"

#define GLSL(...) #__VA_ARGS__

/* clang-format off */

/* A patch in the frame of a plane: axes in world space, corner in metres. */
const char jsl_shader_plane_vs[] = GLSL(
layout(location = 0) in vec2 vertex;
uniform vec4 plane[5];
out vec3 place;
out vec2 metre;

void main() {
    place = plane[0].xyz + vertex.x * plane[1].xyz + vertex.y * plane[2].xyz;
    metre = vec2(plane[0].w, plane[1].w) + vertex;
    gl_Position = camera * vec4(place, 1.0);
}
);

/* Lines of a grid, filtered over the footprint of a pixel: a line that gets thinner than a pixel
 * gets fainter instead (B. Golus 2022, "The best darn grid shader (yet)", explains why). */
const char jsl_shader_plane_fs[] = GLSL(
in vec3 place;
in vec2 metre;
uniform vec4 plane[5];
uniform sampler2D cloud_map;
layout(location = 0) out vec4 result;

float lines(vec2 at, vec2 foot, float cell, float pixels, float metres) {
    vec2 w = foot / cell;
    vec2 away = 0.5 - abs(fract(at / cell) - 0.5);
    vec2 half_ = max(vec2(0.5 * metres / cell), 0.5 * pixels * w);
    vec2 line = clamp((half_ + 0.5 * w - away) / max(w, 1e-6), 0.0, 1.0);
    line *= clamp(1.6 - 4.0 * w, 0.0, 1.0);
    return max(line.x, line.y);
}

void main() {
    vec3 n = cross(plane[1].xyz, plane[2].xyz);
    vec2 dx = dFdx(metre);
    vec2 dy = dFdy(metre);
    vec2 foot = sqrt(dx * dx + dy * dy);
    float minor = lines(metre, foot, grid.x, 1.0, 0.012 * grid.x);
    float major = lines(metre, foot, grid.x * 10.0, 1.6, 0.030 * grid.x);
    float light = SHADED ? sunlit(place, n) : 1.0;
    vec3 albedo = plane[4].rgb;
    vec3 mark = screen.w > 0.5 ? albedo * 2.2 : albedo * 0.42;
    albedo = mix(albedo, mark, grid.y * max(0.55 * minor, major));
    float open = 1.0;
    if (LEVEL) {
        vec2 t = (place.xy - cloud.xy) * cloud.zw;
        float thick = texture(cloud_map, t).r * grid.z;
        thick = 1.0 - exp(-thick);
        light *= 1.0 - 0.65 * thick;
        open = 1.0 - 0.2 * thick;
    }
    vec3 c = diffuse(albedo, n, light, open);
    float alpha = plane[4].w;
    if (!LEVEL) {
        float r = length(place - plane[0].xyz) * plane[2].w;
        alpha += 0.5 * grid.y * max(0.6 * minor, major) * (1.0 - alpha);
        alpha *= 1.0 - smoothstep(0.75, 1.0, r);
    }
    result = vec4(tone(haze(c, place)), alpha);
}
);

const char jsl_shader_screen_vs[] = GLSL(
out vec2 at;

void main() {
    at = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
    gl_Position = vec4(at, 0.0, 1.0);
}
);

const char jsl_shader_sky_fs[] = GLSL(
in vec2 at;
layout(location = 0) out vec4 result;

float star(vec3 d) {
    vec3 p = floor(d * 160.0);
    float h = fract(sin(dot(p, vec3(12.99, 78.23, 37.72))) * 43758.5);
    vec3 f = d * 160.0 - p - 0.5;
    return h > 0.985 ? max(0.0, 1.0 - 5.0 * dot(f, f)) * (h - 0.985) * 40.0 : 0.0;
}

void main() {
    vec3 d = normalize(forward.xyz + at.x * right.xyz + at.y * up.xyz);
    vec3 c = sky(d);
    if (screen.w > 0.5) c += vec3(0.5) * star(d) * clamp(d.z * 3.0, 0.0, 1.0);
    result = vec4(tone(c), 1.0);
}
);

/* Corners arrive in clip space, worked out on the CPU together with the order. */
const char jsl_shader_sprite_vs[] = GLSL(
layout(location = 0) in vec4 clip;
layout(location = 1) in vec3 corner;
layout(location = 2) in vec4 rgba;
out vec3 at;
flat out vec4 color;

void main() {
    at = corner * 2.0;
    color = rgba;
    gl_Position = clip;
}
);

/* at.xy is 1 long on the rim of the ellipse; at.z says how much a place faces the sun: a hint of a
 * ball. */
const char jsl_shader_sprite_fs[] = GLSL(
in vec3 at;
flat in vec4 color;
layout(location = 0) out vec4 result;

void main() {
    float f = max(1.0 - dot(at.xy, at.xy), 0.0);
    if (ADD) result = vec4(color.rgb, color.a * f * f * f);
    else result = vec4(color.rgb * (0.90 + 0.16 * at.z), color.a * f * (2.0 - f));
}
);

const char jsl_shader_blur_fs[] = GLSL(
in vec2 at;
uniform sampler2D image_a;
uniform vec4 stride;
layout(location = 0) out vec4 result;

void main() {
    vec2 t = at * 0.5 + 0.5;
    vec3 c = texture(image_a, t).rgb * 0.227;
    vec2 a = stride.xy * 1.385;
    vec2 b = stride.xy * 3.231;
    c += (texture(image_a, t + a).rgb + texture(image_a, t - a).rgb) * 0.316;
    c += (texture(image_a, t + b).rgb + texture(image_a, t - b).rgb) * 0.0703;
    result = vec4(c, 1.0);
}
);

/* Light that adds up without limit is laid over the picture like exposures of a film: it saturates
 * towards white. */
const char jsl_shader_glow_fs[] = GLSL(
in vec2 at;
uniform sampler2D image_a;
uniform sampler2D image_b;
layout(location = 0) out vec4 result;

void main() {
    vec2 t = at * 0.5 + 0.5;
    vec3 c = texture(image_a, t).rgb + 0.55 * texture(image_b, t).rgb;
    vec3 over = 1.0 - exp(-c);
    result = vec4(over, 1.0);
}
);

/* clang-format on */

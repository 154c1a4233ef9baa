/* SPDX-License-Identifier: MIT
 * jostle/wind.h - moving air, felt by everything that has drag. Floor 1.
 */
#ifndef JOSTLE_WIND_H
#define JOSTLE_WIND_H

#include <jostle/math.h>

/* Mean wind and gusts: w(t) = velocity + sum over three sines of incommensurate periods whose
 * amplitudes sum to gust, along gust_direction (zero: along velocity). Uniform in space. */
typedef struct jsl_wind {
    jsl_vec3 velocity;       /* m/s */
    jsl_vec3 gust_direction; /* any length */
    jsl_real gust;           /* m/s, largest departure */
    jsl_real gust_period;    /* s, of the slowest sine; 0: 5 s */
} jsl_wind;

static inline jsl_vec3 jsl_wind_at(const jsl_wind *wind, double time) {
    if (!wind) return jsl_v3(0, 0, 0);
    if (wind->gust == 0) return wind->velocity;
    jsl_vec3 along = jsl_normalize(jsl_length_sq(wind->gust_direction) > 0 ? wind->gust_direction
                                                                           : wind->velocity);
    double turns = time / (wind->gust_period > 0 ? (double)wind->gust_period : 5.0);
    /* Periods 1, 1/2.3 and 1/5.1; the whole turns are dropped in double so that long runs stay
     * accurate. */
    static const double rate[3] = {1.0, 2.3, 5.1}, phase[3] = {0.0, 0.37, 0.71},
                        share[3] = {0.5, 0.3, 0.2};
    double sum = 0;
    for (int i = 0; i < 3; i++) {
        double t = turns * rate[i] + phase[i];
        sum += share[i] * (double)jsl_sin((jsl_real)(6.283185307179586 * (t - floor(t))));
    }
    return jsl_mul_add(wind->velocity, wind->gust * (jsl_real)sum, along);
}

#endif

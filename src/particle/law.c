/* SPDX-License-Identifier: MIT
 * One step of v' = a - k v, x' = v as an affine map. Floor 4.
 *
 * With z = k h, every method below has the form
 *     v1 = keep v0 + gain a,   x1 = x0 + run v0 + lift a
 * because the law is linear and a is constant over the step.
 */
#include "particle/room.h"

/* phi[0] = e^-z, phi[1] = (1 - phi[0])/z, phi[2] = (1 - phi[1])/z. The last is the series sum
 * (-z)^n / (n+2)!; larger z are halved first and doubled back, where phi1(2z) = phi1 - z phi1^2/2
 * and phi2(2z) = phi2/2 + phi1^2/4 lose nothing to cancellation. */
void jsl_particle_phi(double z, double phi[3]) {
    static const double inverse_factorial[] = {
        1.0 / 2,         1.0 / 6,          1.0 / 24,          1.0 / 120,          1.0 / 720,
        1.0 / 5040,      1.0 / 40320,      1.0 / 362880,      1.0 / 3628800,      1.0 / 39916800,
        1.0 / 479001600, 1.0 / 6227020800, 1.0 / 87178291200, 1.0 / 1307674368000};
    int halvings = 0;
    for (; z > 0.5; z *= 0.5) halvings++;
    /* The first term left out is below 2^-54 of the first: z^n / (n+2)! < 0.5 * 5e-17. */
    int n = z < 1e-3 ? 5 : z < 0.03 ? 8 : 14;
    double p2 = 0;
    while (n > 0) p2 = inverse_factorial[--n] - z * p2;
    double p1 = 1 - z * p2, p0 = 1 - z * p1;
    for (; halvings > 0; halvings--) {
        p2 = 0.5 * p2 + 0.25 * (p1 * p1);
        p1 = 0.5 * p1 * (1 + p0);
        p0 = p0 * p0;
    }
    phi[0] = p0;
    phi[1] = p1;
    phi[2] = p2;
}

jsl_particle_map jsl_particle_map_of(const jsl_particle_law *law, double h) {
    double z = (double)law->k * h, keep = 1, gain = h, run = h, lift = 0.5 * h * h;
    double phi[3];
    switch (law->integrator) {
    case JSL_PARTICLE_SEMI_IMPLICIT:
        keep = 1 - z;
        run = h * keep;
        lift = h * h;
        break;
    case JSL_PARTICLE_EXPLICIT:
        keep = 1 - z;
        lift = 0;
        break;
    case JSL_PARTICLE_VERLET:
        /* x1 = x0 + h v0 + h^2/2 f(v0); v1 = v0 + h/2 (f(v0) + f(v1)), the last solved for v1. */
        keep = (1 - 0.5 * z) / (1 + 0.5 * z);
        gain = h / (1 + 0.5 * z);
        run = h * (1 - 0.5 * z);
        break;
    case JSL_PARTICLE_RK4:
        keep = 1 - z * (1 - z / 2 * (1 - z / 3 * (1 - z / 4)));
        gain = h * (1 - z / 2 * (1 - z / 3 * (1 - z / 4)));
        run = gain;
        lift = h * h * (0.5 - z / 6 * (1 - z / 4));
        break;
    default:
        if (z > 0) {
            jsl_particle_phi(z, phi);
            keep = phi[0];
            gain = h * phi[1];
            run = gain;
            lift = h * h * phi[2];
        }
        break;
    }
    jsl_real g = (jsl_real)gain, l = (jsl_real)lift;
    return (jsl_particle_map){(jsl_real)keep, (jsl_real)run, jsl_scale(law->a, g),
                              jsl_scale(law->a, l)};
}

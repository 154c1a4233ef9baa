/* SPDX-License-Identifier: MIT
 * mat3.c - rotation matrices and the eigenvalues of symmetric tensors.
 */
#include <jostle/math.h>

jsl_mat3 jsl_mat3_from_quat(jsl_quat q) {
    jsl_real xx = q.x * q.x, yy = q.y * q.y, zz = q.z * q.z;
    jsl_real xy = q.x * q.y, xz = q.x * q.z, yz = q.y * q.z;
    jsl_real wx = q.w * q.x, wy = q.w * q.y, wz = q.w * q.z;
    return (jsl_mat3){{1 - 2 * (yy + zz), 2 * (xy - wz), 2 * (xz + wy)},
                      {2 * (xy + wz), 1 - 2 * (xx + zz), 2 * (yz - wx)},
                      {2 * (xz - wy), 2 * (yz + wx), 1 - 2 * (xx + yy)}};
}

jsl_mat3 jsl_mat3_rotate_diagonal(jsl_quat q, jsl_vec3 d) {
    jsl_mat3 m = jsl_mat3_from_quat(q);
    jsl_vec3 a = jsl_v3(m.r0.x * d.x, m.r0.y * d.y, m.r0.z * d.z);
    jsl_vec3 b = jsl_v3(m.r1.x * d.x, m.r1.y * d.y, m.r1.z * d.z);
    jsl_vec3 c = jsl_v3(m.r2.x * d.x, m.r2.y * d.y, m.r2.z * d.z);
    jsl_real ab = jsl_dot(a, m.r1), ac = jsl_dot(a, m.r2), bc = jsl_dot(b, m.r2);
    return (jsl_mat3){
        {jsl_dot(a, m.r0), ab, ac}, {ab, jsl_dot(b, m.r1), bc}, {ac, bc, jsl_dot(c, m.r2)}};
}

/* Unit quaternion of a proper rotation matrix, by its largest component (Shepperd 1978). */
static jsl_quat quat_from_columns(double m[3][3]) {
    double trace = m[0][0] + m[1][1] + m[2][2];
    double q[4]; /* x y z w */
    int k = 3;
    double best = trace;
    for (int i = 0; i < 3; i++)
        if (m[i][i] > best) best = m[i][i], k = i;
    if (k == 3) {
        q[3] = 1 + trace;
        q[0] = m[2][1] - m[1][2];
        q[1] = m[0][2] - m[2][0];
        q[2] = m[1][0] - m[0][1];
    } else {
        int i = (k + 1) % 3, j = (k + 2) % 3;
        q[k] = 1 + m[k][k] - m[i][i] - m[j][j];
        q[i] = m[i][k] + m[k][i];
        q[j] = m[j][k] + m[k][j];
        q[3] = m[j][i] - m[i][j];
    }
    double n = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    if (!(n > 0)) return jsl_quat_identity();
    if (q[3] < 0) n = -n;
    return (jsl_quat){(jsl_real)(q[0] / n), (jsl_real)(q[1] / n), (jsl_real)(q[2] / n),
                      (jsl_real)(q[3] / n)};
}

/* One Jacobi rotation in the plane (p, q) that makes a[p][q] zero; v collects the rotations. */
static void rotate_plane(double a[3][3], double v[3][3], int p, int q) {
    double off = a[p][q];
    /* Relative to its own diagonal, so that small moments beside large ones keep their digits. */
    double size = sqrt(fabs(a[p][p])) * sqrt(fabs(a[q][q]));
    if (fabs(off) <= 0x1p-56 * size || fabs(off) < 0x1p-200) {
        a[p][q] = a[q][p] = 0;
        return;
    }
    double theta = (a[q][q] - a[p][p]) / (2 * off);
    double t = 1 / (fabs(theta) + sqrt(theta * theta + 1));
    if (theta < 0) t = -t;
    double c = 1 / sqrt(t * t + 1), s = t * c;
    int r = 3 - p - q;
    a[p][p] -= t * off;
    a[q][q] += t * off;
    a[p][q] = a[q][p] = 0;
    double arp = a[r][p], arq = a[r][q];
    a[r][p] = a[p][r] = c * arp - s * arq;
    a[r][q] = a[q][r] = s * arp + c * arq;
    for (int i = 0; i < 3; i++) {
        double vip = v[i][p], viq = v[i][q];
        v[i][p] = c * vip - s * viq;
        v[i][q] = s * vip + c * viq;
    }
}

static void swap_columns(double *moment, double v[3][3], int i, int j) {
    if (!(moment[j] < moment[i])) return;
    double m = moment[i];
    moment[i] = moment[j];
    moment[j] = m;
    for (int r = 0; r < 3; r++) {
        double x = v[r][i];
        v[r][i] = v[r][j];
        v[r][j] = -x; /* a swap with a change of sign is a rotation: v stays proper */
    }
}

void jsl_mat3_eigen_symmetric(jsl_mat3 m, jsl_vec3 *moments, jsl_quat *frame) {
    /* Always in double: the solver's inverse inertias are made from this, and it is not in a loop.
     */
    double a[3][3] = {{(double)m.r0.x, (double)m.r0.y, (double)m.r0.z},
                      {(double)m.r1.x, (double)m.r1.y, (double)m.r1.z},
                      {(double)m.r2.x, (double)m.r2.y, (double)m.r2.z}};
    double v[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    double scale = 0;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            a[i][j] = 0.5 * a[i][j] + 0.5 * (i == j ? a[i][j] : a[j][i]);
            scale = fabs(a[i][j]) > scale ? fabs(a[i][j]) : scale;
        }
    if (scale > 0 && scale <= 0x1.fffffffffffffp+1023) {
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++) a[i][j] /= scale;
    } else {
        scale = 1;
    }
    for (int sweep = 0; sweep < 16; sweep++) {
        if (a[0][1] == 0 && a[0][2] == 0 && a[1][2] == 0) break;
        rotate_plane(a, v, 0, 1);
        rotate_plane(a, v, 0, 2);
        rotate_plane(a, v, 1, 2);
    }
    double moment[3] = {a[0][0] * scale, a[1][1] * scale, a[2][2] * scale};
    swap_columns(moment, v, 0, 1);
    swap_columns(moment, v, 1, 2);
    swap_columns(moment, v, 0, 1);
    *moments = jsl_v3((jsl_real)moment[0], (jsl_real)moment[1], (jsl_real)moment[2]);
    *frame = quat_from_columns(v);
}

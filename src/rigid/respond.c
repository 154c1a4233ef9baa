/* SPDX-License-Identifier: MIT
 * respond.c - one step of the soft-step solver: sub-steps of kick, solve, drift, relax over
 * coloured blocks.
 */
#include "rigid/room.h"

/* Fewer lanes than this a worker are not worth a barrier. */
#define LANES_A_WORKER 256

typedef struct run {
    jsl_rigid_room *room;
    jsl_rigid_pass pass;
    jsl_rigid_kernels kernel, one; /* one: a lane at a time */
    int substeps;
    int64_t slots; /* padded */
    bool serial;   /* only worker 0 works */
    jsl_barrier barrier;
    double prepared; /* when worker 0 had */
} run;

static jsl_rigid_kernels kernels_of(jsl_isa isa) {
    return (jsl_rigid_kernels){
        JSL_KERNEL_PICK(isa, jsl_rigid_prepare),
        JSL_KERNEL_PICK(isa, jsl_rigid_store),
        {JSL_KERNEL_PICK(isa, jsl_rigid_warm), JSL_KERNEL_PICK(isa, jsl_rigid_warm_wall)},
        {JSL_KERNEL_PICK(isa, jsl_rigid_solve), JSL_KERNEL_PICK(isa, jsl_rigid_solve_wall)},
        {JSL_KERNEL_PICK(isa, jsl_rigid_relax), JSL_KERNEL_PICK(isa, jsl_rigid_relax_wall)},
        {JSL_KERNEL_PICK(isa, jsl_rigid_bounce), JSL_KERNEL_PICK(isa, jsl_rigid_bounce_wall)},
        JSL_KERNEL_PICK(isa, jsl_rigid_kick_first),
        JSL_KERNEL_PICK(isa, jsl_rigid_kick_next),
        JSL_KERNEL_PICK(isa, jsl_rigid_drift),
    };
}

jsl_rigid_soft jsl_rigid_soft_of(jsl_real hertz, jsl_real zeta, jsl_real h) {
    if (!(hertz > 0)) return (jsl_rigid_soft){0, 1, 0};
    jsl_real w = 2 * JSL_PI * hertz, a1 = 2 * zeta + h * w, a2 = h * w * a1, a3 = 1 / (1 + a2);
    return (jsl_rigid_soft){w / a1, a2 * a3, a3};
}

/* The share [begin, end) of n units that a worker takes; the same in every pass, so that caches
 * stay warm. */
static void share(int64_t n, int worker, int workers, int64_t *begin, int64_t *end) {
    *begin = n * worker / workers;
    *end = n * (worker + 1) / workers;
}

static void wait(run *r, int workers) {
    if (workers > 1) jsl_barrier_wait(&r->barrier, workers);
}

/* One pass over all colours; `which` are the two forms of the kernel, `one` the same a lane at a
 * time. */
static void over_colours(run *r, jsl_rigid_lanes_fn *const which[2],
                         jsl_rigid_lanes_fn *const one[2], int worker, int workers) {
    for (int64_t i = 0; i < r->room->colour.count; i++) {
        const jsl_rigid_colour *c = &r->room->colour.at[i];
        if (c->serial) {
            if (worker == 0) one[c->wall](&r->pass, c->begin, c->begin + c->count);
        } else {
            int64_t blocks = jsl_round_up(c->count, JSL_LANES) / JSL_LANES, begin, end;
            share(blocks, worker, workers, &begin, &end);
            if (end > begin)
                which[c->wall](&r->pass, c->begin + begin * JSL_LANES, c->begin + end * JSL_LANES);
        }
        wait(r, workers);
    }
}

static void over_slots(run *r, jsl_rigid_slots_fn *fn, int worker, int workers, int64_t *first,
                       int64_t *last) {
    share(r->slots / JSL_LANES, worker, workers, first, last);
    *first *= JSL_LANES, *last *= JSL_LANES;
    if (fn) fn(&r->pass, *first, *last);
}

/* The listed splitting bodies among slots [first, last). */
static void split_range(const jsl_rigid_room *room, int64_t first, int64_t last, int64_t *begin,
                        int64_t *end) {
    *begin = 0;
    while (*begin < room->split.count && room->split.at[*begin] < first) ++*begin;
    *end = *begin;
    while (*end < room->split.count && room->split.at[*end] < last) ++*end;
}

static void last_half_kick(run *r, int worker, int workers) {
    int64_t first, last, begin, end;
    over_slots(r, NULL, worker, workers, &first, &last);
    split_range(r->room, first, last, &begin, &end);
    for (int64_t k = begin; k < end; k++) {
        int64_t i = r->room->split.at[k];
        jsl_real *w = r->pass.bodies.line + i * JSL_LINE + 4;
        const jsl_real *kick = r->pass.bodies.kick + i * JSL_KICK + 4;
        for (int c = 0; c < 3; c++) w[c] += JSL_R(0.5) * r->pass.h * kick[c];
    }
}

static void step_region(void *arg, int worker, int workers) {
    run *r = arg;
    if (r->serial) {
        if (worker > 0) return;
        workers = 1;
    }
    jsl_rigid_pass *pass = &r->pass;
    int64_t begin, end, first, last;
    share(r->room->lanes / JSL_LANES, worker, workers, &begin, &end);
    r->kernel.prepare(pass, begin * JSL_LANES, end * JSL_LANES);
    wait(r, workers);
    if (worker == 0) r->prepared = jsl_seconds();
    for (int k = 0; k < r->substeps; k++) {
        over_slots(r, k == 0 ? r->kernel.kick_first : r->kernel.kick_next, worker, workers, &first,
                   &last);
        wait(r, workers);
        if (k == 0) over_colours(r, r->kernel.warm, r->one.warm, worker, workers);
        over_colours(r, r->kernel.solve, r->one.solve, worker, workers);
        if (worker == 0)
            pass->kick = 1; /* every later kick of the splitting integrator is a whole one */
        over_slots(r, r->kernel.drift, worker, workers, &first, &last);
        if (r->room->split.count > 0) {
            split_range(r->room, first, last, &begin, &end);
            jsl_rigid_turn_split(&pass->bodies, r->room->split.at + begin, end - begin, pass->h);
        }
        wait(r, workers);
        over_colours(r, r->kernel.relax, r->one.relax, worker, workers);
    }
    if (r->room->split.count > 0) {
        last_half_kick(r, worker, workers);
        wait(r, workers);
    }
    if (pass->bounces) over_colours(r, r->kernel.bounce, r->one.bounce, worker, workers);
    share(r->room->lanes / JSL_LANES, worker, workers, &begin, &end);
    r->kernel.store(pass, begin * JSL_LANES, end * JSL_LANES);
}

static void set_pass(run *r, const jsl_step_context *context) {
    jsl_rigid_room *room = r->room;
    const jsl_rigid_settings *s = &room->settings;
    jsl_rigid_pass *p = &r->pass;
    p->blocks = (jsl_rigid_blocks){room->normal.at, room->friction.at, room->bounce.at,
                                   room->lane_a.at, room->lane_b.at,   room->lane_contact.at};
    p->bodies = (jsl_rigid_bodies){room->line.at, room->move.at, room->base.at,
                                   room->kick.at, room->pose.at, room->turn.at};
    p->geo = room->geo.at;
    p->h = context->dt / (jsl_real)context->substeps;
    p->inv_h = 1 / p->h;
    /* A stiffness that a sub-step cannot follow is lowered. */
    jsl_real hertz = jsl_min(s->contact_hertz > 0 ? s->contact_hertz : 30, JSL_R(0.125) * p->inv_h);
    jsl_real zeta = s->damping_ratio > 0 ? s->damping_ratio : 10;
    p->pair = jsl_rigid_soft_of(hertz, zeta, p->h);
    p->wall = jsl_rigid_soft_of(2 * hertz, JSL_R(0.5) * zeta, p->h);
    p->push = s->push_speed > 0 ? s->push_speed : 3;
    jsl_real threshold = s->restitution_threshold;
    p->threshold = threshold < 0   ? 0
                   : threshold > 0 ? threshold
                                   : 2 * jsl_length(context->gravity) * p->h;
    p->kick = JSL_R(0.5);
    p->bounces = false;
    for (int64_t k = 0; k < room->active.count && !p->bounces; k++)
        p->bounces = JSL_RIGID_GEO(room, room->active.at[k])[JSL_GEO_BOUNCE] > 0;
}

jsl_result jsl_rigid_respond(const jsl_step_context *context, void *user) {
    jsl_rigid_room *room = user;
    if (!(context->dt > 0) || room->slot.count == 0) return JSL_OK;
    double t0 = jsl_seconds();
    run r = {.room = room,
             .kernel = kernels_of(context->isa),
             .one = kernels_of(JSL_ISA_SCALAR),
             .substeps = context->substeps,
             .slots = jsl_round_up(room->slot.count, JSL_LANES)};
    set_pass(&r, context);
    int workers = context->exec ? context->exec->tasks.workers : 1;
    r.serial = workers == 1 || room->lanes + r.slots < (int64_t)LANES_A_WORKER * workers;
    if (r.serial)
        step_region(&r, 0, 1);
    else
        jsl_parallel_region(context->exec, step_region, &r);
    double t1 = jsl_seconds();
    jsl_rigid_slots_finish(room, context);
    room->profile.prepare += r.prepared - t0, room->profile.solve += t1 - r.prepared;
    room->profile.finish += jsl_seconds() - t1;
    room->profile.steps++;
    return JSL_OK;
}

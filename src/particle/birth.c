/* SPDX-License-Identifier: MIT
 * Births: how many, when within the step, where, and with which attributes. Floor 4.
 *
 * A step asks for the instants at which births fall within it. They come from the integral of the
 * rate, whose fraction is carried, so that they are the same instants whatever the length of the
 * steps. Every random number is keyed by the emitter and the serial number of the birth (or of the
 * frame of film, for Reeves' rate), never by the step.
 */
#include "particle/room.h"

enum { STREAM_GAP = 0x6761, STREAM_RATE = 0x7261, STREAM_BIRTH = 0x6269 };

#define BIRTH_BLOCK 512
#define SHORTEST_LIFE JSL_R(0.001)

/* -- How many, and when
 * ------------------------------------------------------------------------------------- */

typedef struct count_state {
    jsl_particle_room *room;
    const jsl_step_context *context;
    uint64_t id;     /* of the emitter */
    uint64_t serial; /* of the next birth */
    double carry;
    int64_t space; /* births that still fit */
    int64_t count; /* times noted in room->birth */
    int64_t dropped;
    bool out_of_memory;
} count_state;

static void note_birth(count_state *s, double when) {
    if (s->count >= s->space) {
        s->dropped++;
        return;
    }
    if (jsl_array_reserve(s->room->memory, &s->room->birth, s->count + 1) != JSL_OK) {
        s->out_of_memory = true;
        s->space = s->count;
        s->dropped++;
        return;
    }
    s->room->birth.at[s->count++] = when;
}

/* A unit exponential: the gap before this birth, in units of the mean. */
static double gap_of(const count_state *s, uint64_t serial) {
    jsl_rng rng = jsl_rng_make(s->context->seed, s->id, serial, STREAM_GAP);
    double u = ((double)(jsl_rng_u64(&rng) >> 40) + 0.5) / 16777216.0;
    return -(double)jsl_log((jsl_real)u);
}

/* Births while the rate is r from `from` to `to`. A negative rate is owed. */
static void count_span(count_state *s, double r, double from, double to, bool poisson) {
    double total = s->carry + r * (to - from), used = 0;
    /* Far beyond what fits there is nothing to time: whole births are dropped at once. */
    double fits = (double)(s->space - s->count);
    if (r > 0 && !poisson && total > fits + 1) {
        bool countable = total < 9e15; /* beyond 2^53 a fraction has no meaning */
        double excess = countable ? floor(total - fits) : 9e15;
        s->dropped += (int64_t)excess;
        s->serial += (uint64_t)excess;
        total = countable ? total - excess : fits;
    }
    for (;;) {
        double need = poisson ? gap_of(s, s->serial) : 1;
        if (!(used + need <= total)) break;
        used += need;
        s->serial++;
        note_birth(s, from + (used - s->carry) / r);
        if (poisson && s->dropped > 1000) {
            used = total; /* memoryless: forgetting the rest is unbiased */
            break;
        }
    }
    s->carry = total - used;
}

static void count_reeves(count_state *s, double rate, double range, double frame, double dt) {
    double start = s->context->time, t = 0;
    uint64_t f = (uint64_t)floor(start / frame);
    while (t < dt) {
        double end = (double)(f + 1) * frame - start;
        if (end > dt) end = dt;
        if (end > t) {
            jsl_rng rng = jsl_rng_make(s->context->seed, s->id, f, STREAM_RATE);
            count_span(s, rate + (double)jsl_rng_signed(&rng) * range, t, end, false);
            t = end;
        }
        f++;
    }
}

static void count_births(count_state *s, const jsl_emitter_columns *e, double dt) {
    for (uint64_t i = 0; i < *e->waiting; i++) {
        if (s->count >= s->space) {
            s->dropped += (int64_t)(*e->waiting - i);
            s->serial += *e->waiting - i;
            break;
        }
        s->serial++;
        note_birth(s, 0);
    }
    double rate = (double)*e->rate;
    switch (*e->emit_mode) {
    case JSL_EMIT_REFILL: {
        int64_t missing = s->space - s->count;
        for (int64_t i = 0; i < missing; i++, s->serial++)
            note_birth(s, dt * ((double)i + 0.5) / (double)missing);
        break;
    }
    case JSL_EMIT_REEVES:
        count_reeves(s, rate, (double)*e->rate_range, (double)*e->rate_frame, dt);
        break;
    default:
        count_span(s, rate, 0, dt, *e->emit_mode == JSL_EMIT_POISSON);
        break;
    }
}

/* -- Where, and with which attributes
 * ----------------------------------------------------------------------- */

typedef struct birth_job {
    const jsl_particle_room *room;
    const jsl_particle_rules *rules;
    uint64_t seed, id, serial; /* of the first birth */
    double dt;
    const double *when;
    jsl_emitter_desc desc;
    jsl_vec3 p0, p1, velocity; /* of the emitter */
    jsl_quat q0, q1;
    jsl_vec3 axis, side, up; /* of the cone */
    jsl_real cone_height;    /* 1 - cos of its half angle */
    bool solid;              /* there is something to bounce off */
    jsl_position_columns p;
    jsl_velocity_columns v;
    jsl_particle_columns q;
} birth_job;

static jsl_vec3 on_sphere(jsl_real a, jsl_real b) {
    jsl_real z = 2 * a - 1, r = jsl_sqrt(jsl_max(1 - z * z, 0)), s, c;
    jsl_sin_cos(2 * JSL_PI * b, &s, &c);
    return jsl_v3(r * c, r * s, z);
}

/* Uniform within the shape, from five numbers in [0, 1). */
static jsl_vec3 point_in(const jsl_emitter_desc *d, const jsl_real u[5]) {
    jsl_real r = d->extent.x, s, c;
    switch (d->shape) {
    case JSL_EMITTER_LINE:
        return jsl_v3((2 * u[0] - 1) * r, 0, 0);
    case JSL_EMITTER_DISC:
        jsl_sin_cos(2 * JSL_PI * u[1], &s, &c);
        r *= jsl_sqrt(u[0]);
        return jsl_v3(r * c, r * s, 0);
    case JSL_EMITTER_SPHERE:
        /* The largest of three uniforms has the law r^3 of the distance from the centre. */
        return jsl_scale(on_sphere(u[0], u[1]), r * jsl_max(u[2], jsl_max(u[3], u[4])));
    case JSL_EMITTER_SHELL:
        return jsl_scale(on_sphere(u[0], u[1]), r);
    case JSL_EMITTER_BOX:
        return jsl_v3((2 * u[0] - 1) * r, (2 * u[1] - 1) * d->extent.y,
                      (2 * u[2] - 1) * d->extent.z);
    default:
        return jsl_v3(0, 0, 0);
    }
}

/* Uniform in the solid angle: the height 1 - cos is uniform (Archimedes). */
static jsl_vec3 direction_in(const birth_job *job, jsl_real a, jsl_real b) {
    if (job->cone_height == 0) return job->axis;
    jsl_real w = a * job->cone_height, s, c;
    jsl_real r = jsl_sqrt(jsl_max(w * (2 - w), 0));
    jsl_sin_cos(2 * JSL_PI * b, &s, &c);
    return jsl_mul_add(jsl_mul_add(jsl_scale(job->axis, 1 - w), r * c, job->side), r * s, job->up);
}

static void be_born(const birth_job *job, int64_t i) {
    const jsl_emitter_desc *d = &job->desc;
    jsl_rng rng = jsl_rng_make(job->seed, job->id, job->serial + (uint64_t)i, STREAM_BIRTH);
    jsl_real u[10]; /* always as many, so that changing one setting leaves the other draws alone */
    for (int k = 0; k < 10; k++) u[k] = jsl_rng_unit(&rng);
    double when = job->when[i];
    jsl_real f = (jsl_real)(when / job->dt);
    jsl_vec3 x = jsl_mul_add(job->p0, f, jsl_sub(job->p1, job->p0));
    jsl_quat a = job->q0, b = job->q1, turn = a;
    if (a.x != b.x || a.y != b.y || a.z != b.z || a.w != b.w) {
        jsl_real s = a.x * b.x + a.y * b.y + a.z * b.z + a.w * b.w < 0 ? -f : f;
        turn = jsl_quat_normalize((jsl_quat){a.x * (1 - f) + b.x * s, a.y * (1 - f) + b.y * s,
                                             a.z * (1 - f) + b.z * s, a.w * (1 - f) + b.w * s});
    }
    jsl_real speed = d->speed + (2 * u[7] - 1) * d->speed_range;
    jsl_real life = d->life > 0 ? d->life + (2 * u[8] - 1) * d->life_range : 0;
    if (d->life > 0 && life < SHORTEST_LIFE) life = SHORTEST_LIFE;
    jsl_real size = jsl_max(d->size + (2 * u[9] - 1) * d->size_range, 0);
    x = jsl_add(x, jsl_rotate(turn, point_in(d, u)));
    jsl_vec3 v = jsl_scale(jsl_rotate(turn, direction_in(job, u[5], u[6])), speed);
    v = jsl_mul_add(v, d->inherit, job->velocity);
    jsl_real age = (jsl_real)(job->dt - when);
    if (age > 0) {
        jsl_particle_map map = jsl_particle_map_of(&job->rules->law, (double)age);
        if (job->solid)
            jsl_particle_bounce(&job->room->solids, job->rules, &map, d->contact_size * size,
                                (jsl_real)when, age, &x, &v);
        else
            jsl_particle_apply(&map, &x, &v);
    }
    job->p.px[i] = x.x;
    job->p.py[i] = x.y;
    job->p.pz[i] = x.z;
    job->v.vx[i] = v.x;
    job->v.vy[i] = v.y;
    job->v.vz[i] = v.z;
    job->q.age[i] = life > 0 ? age : 0;
    job->q.life[i] = life;
    job->q.size[i] = size;
    job->q.emitter[i] = job->rules->emitter;
}

static void run_births(void *arg, int64_t begin, int64_t end, int64_t block, int worker) {
    (void)block, (void)worker;
    for (int64_t i = begin; i < end; i++) be_born(arg, i);
}

/* -- The system
 * ------------------------------------------------------------------------------------------------
 */

static jsl_result emitter_rows(const jsl_particle_room *room, jsl_entity entity,
                               jsl_emitter_columns *e, jsl_position_columns *p,
                               jsl_orientation_columns *q) {
    jsl_rows rows;
    JSL_TRY(jsl_rows_of_entity(room->ecs, entity, room->emitter, &rows));
    *e = jsl_emitter_of(&rows, 0);
    JSL_TRY(jsl_rows_of_entity(room->ecs, entity, room->position, &rows));
    *p = jsl_position_of(&rows, 0);
    JSL_TRY(jsl_rows_of_entity(room->ecs, entity, room->orientation, &rows));
    *q = jsl_orientation_of(&rows, 0);
    return JSL_OK;
}

static void set_cone(birth_job *job) {
    job->axis = job->desc.direction;
    job->side = jsl_perpendicular(job->axis);
    job->up = jsl_cross(job->axis, job->side);
    jsl_real s = jsl_sin(job->desc.cone / 2);
    job->cone_height = 2 * s * s; /* 1 - cos without cancellation */
}

/* Creates and fills `count` particles. */
static jsl_result give_birth(jsl_particle_room *room, const jsl_step_context *context,
                             int32_t rules, uint64_t serial, int64_t count) {
    const jsl_component set[] = {room->position, room->velocity, room->particle};
    const jsl_particle_rules *r = &room->rules.at[rules];
    jsl_emitter_columns e;
    jsl_position_columns p;
    jsl_orientation_columns q;
    jsl_rows rows;
    birth_job job = {.room = room, .rules = r, .seed = context->seed, .serial = serial};
    JSL_TRY(jsl_particle_room_emitter_get(room, (jsl_emitter){r->emitter}, &job.desc));
    JSL_TRY(emitter_rows(room, r->emitter, &e, &p, &q));
    job.id = jsl_entity_id(r->emitter);
    job.dt = (double)context->dt;
    job.when = room->birth.at;
    job.p0 = jsl_v3(*e.was_px, *e.was_py, *e.was_pz);
    job.q0 = (jsl_quat){*e.was_qx, *e.was_qy, *e.was_qz, *e.was_qw};
    job.p1 = job.desc.position;
    job.q1 = job.desc.orientation;
    job.velocity = job.desc.velocity;
    job.solid = !r->ghost && (r->planes > 0 || (room->solids.set && room->grid.n[0]));
    set_cone(&job);
    JSL_TRY(jsl_entity_create_n(room->ecs, set, JSL_COUNT(set), count, NULL, &rows));
    job.p = jsl_position_of(&rows, 0);
    job.v = jsl_velocity_of(&rows, 1);
    job.q = jsl_particle_of(&rows, 2);
    jsl_parallel_for(context->exec, count, BIRTH_BLOCK, run_births, &job);
    return jsl_particle_runs_append(room, &rows, rules, job.desc.life > 0);
}

static jsl_result emit(jsl_particle_room *room, const jsl_step_context *context, int32_t rules) {
    jsl_particle_rules *r = &room->rules.at[rules];
    jsl_emitter_columns e;
    jsl_position_columns p;
    jsl_orientation_columns q;
    JSL_TRY(emitter_rows(room, r->emitter, &e, &p, &q));
    int64_t space = *e.max_particles - r->alive;
    count_state s = {.room = room,
                     .context = context,
                     .id = jsl_entity_id(r->emitter),
                     .serial = *e.serial,
                     .carry = *e.carry,
                     .space = space > 0 ? space : 0};
    count_births(&s, &e, (double)context->dt);
    uint64_t first = s.serial - (uint64_t)s.count - (uint64_t)s.dropped;
    if (s.count > 0 && give_birth(room, context, rules, first, s.count) != JSL_OK) {
        s.out_of_memory = true;
        s.dropped += s.count;
        s.count = 0;
    }
    if (s.dropped > 0)
        jsl_warn(context, s.out_of_memory ? JSL_WARN_OUT_OF_MEMORY : JSL_WARN_PARTICLES_FULL,
                 s.dropped, r->emitter);
    JSL_TRY(emitter_rows(room, r->emitter, &e, &p, &q)); /* rows may have moved */
    *e.serial = s.serial;
    *e.carry = s.carry;
    *e.waiting = 0;
    *e.alive = (uint64_t)(r->alive + s.count);
    *e.was_px = *p.px;
    *e.was_py = *p.py;
    *e.was_pz = *p.pz;
    *e.was_qx = *q.qx;
    *e.was_qy = *q.qy;
    *e.was_qz = *q.qz;
    *e.was_qw = *q.qw;
    return JSL_OK;
}

jsl_result jsl_particle_birth_system(const jsl_step_context *context, void *user) {
    jsl_particle_room *room = user;
    if (!(context->dt > 0)) return JSL_OK;
    JSL_TRY(jsl_particle_prepare(room, context));
    for (int64_t t = 0; t < room->table.count; t++) {
        const jsl_particle_table *table = &room->table.at[t];
        for (int64_t i = 0; i < table->run.count && table->rows > 0; i++)
            if (table->run.at[i].rules >= 0)
                room->rules.at[table->run.at[i].rules].alive +=
                    table->run.at[i].end - table->run.at[i].begin;
    }
    for (int64_t i = 0; i < room->rules.count; i++) JSL_TRY(emit(room, context, (int32_t)i));
    return JSL_OK;
}

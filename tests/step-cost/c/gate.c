/* The gate: limits target angles to range, pose envelope, rate and acceleration at every tick, as joint-loop computes it, with the
   shortcuts for each joint and without the one for targets that no limit changes (`Gate::follow`).
   Positions are in steps of 2^-28 rad, so the results are equal bit for bit. The documentation of
   joint-loop/src/motion/gate.rs has the equations. Compiled twice as networks.c. */

#include <stdbool.h>
#include <stdint.h>

enum { JOINTS = 4, EDGES = 6 };
enum { RANGE = 1, POSE = 2, RATE = 4, ACCELERATION = 8 };

static const float STEPS = 268435456.0f;

struct limits {
    int32_t least, most;
    int32_t rate;
    uint32_t acceleration;
    /* Both ends of the range, rad. */
    float ends[2];
    /* With so much clearance or more, a bound allows every step that the rate allows. */
    int32_t clearance;
};

/* q[joints[0]] + sign q[joints[1]] <= most. */
struct edge {
    uint32_t joints[2];
    int32_t sign, most;
    /* Up to this sum, the edge bounds no step of its joints. */
    int32_t far;
};

struct gate {
    struct limits joints[JOINTS];
    struct edge edges[EDGES];
    uint32_t edge_count;
};

struct gate_state {
    int32_t position[JOINTS], step[JOINTS], goal[JOINTS];
};

struct bound {
    int32_t step;
    uint32_t why;
};

static inline int64_t min64(int64_t a, int64_t b) { return a < b ? a : b; }

static inline int32_t sum(const struct edge *edge, const int32_t *position) {
    return position[edge->joints[0]] + edge->sign * position[edge->joints[1]];
}

static inline int32_t hold(const struct limits *limits, int64_t position) {
    return position < limits->least ? limits->least : position > limits->most ? limits->most : (int32_t)position;
}

/* How far a joint still moves that brakes from the step v. */
static int64_t brake(const struct limits *limits, int64_t v) {
    int64_t n = (uint32_t)v / limits->acceleration;
    return n * v - (int64_t)limits->acceleration * n * (n + 1) / 2;
}

static uint32_t root(uint32_t of) {
    uint32_t found = 0;
    for (uint32_t bit = 1u << 30; bit != 0; bit >>= 2) {
        if (of >= found + bit) {
            of -= found + bit;
            found = (found >> 1) + bit;
        } else {
            found >>= 1;
        }
    }
    return found;
}

/* The greatest v with v + brake(v) <= margin; the margin itself if it is negative. */
static int64_t reach(const struct limits *limits, int64_t room) {
    if (room < 0 || room > UINT32_MAX) return min64(room, UINT32_MAX);
    uint32_t margin = (uint32_t)room, a = limits->acceleration;
    if (margin < a) return margin;
    uint64_t eight = (uint64_t)(margin / a) * 8;
    uint32_t under = eight >= UINT32_MAX ? UINT32_MAX : (uint32_t)eight + 1;
    uint32_t n = (root(under) - 1) / 2;
    uint32_t whole = a * (n * (n + 1) / 2);
    return n * a + (margin - whole) / (n + 1);
}

/* Bounds of a step by acceleration and rate. */
static inline void own_bounds(const struct limits *limits, int32_t last, struct bound *low, struct bound *high) {
    int32_t a = (int32_t)limits->acceleration;
    *low = -limits->rate > last - a ? (struct bound){-limits->rate, RATE} : (struct bound){last - a, ACCELERATION};
    *high = limits->rate < last + a ? (struct bound){limits->rate, RATE} : (struct bound){last + a, ACCELERATION};
}

static inline struct bound nearest(int32_t asked, struct bound low, struct bound high) {
    return asked > high.step ? high : asked < low.step ? low : (struct bound){asked, ACCELERATION};
}

/* The furthest sign q that a joint reaches while it brakes; with `from_next` the braking includes this tick. */
static int64_t peak(const struct gate *gate, const struct gate_state *now, uint32_t joint, int32_t sign, bool from_next) {
    const struct limits *limits = &gate->joints[joint];
    int64_t here = (int64_t)sign * now->position[joint], outward = (int64_t)sign * now->step[joint];
    if (outward > 0) return here + brake(limits, outward);
    return from_next ? here + min64(outward + limits->acceleration, 0) : here;
}

static inline void bound(const struct limits *limits, int32_t sign, int64_t margin, uint32_t why, struct bound *low,
                         struct bound *high) {
    if (margin >= limits->clearance) return;
    int32_t most = (int32_t)reach(limits, margin);
    if (sign > 0 && most < high->step) *high = (struct bound){most, why};
    else if (sign < 0 && -most > low->step) *low = (struct bound){-most, why};
}

/* The viable step nearest to the one asked for. */
static struct bound admit(const struct gate *gate, const struct gate_state *now, uint32_t at, int32_t asked) {
    const struct limits *limits = &gate->joints[at];
    int64_t position = now->position[at];
    struct bound low, high;
    own_bounds(limits, now->step[at], &low, &high);
    bound(limits, 1, limits->most - position, RANGE, &low, &high);
    bound(limits, -1, position - limits->least, RANGE, &low, &high);
    for (uint32_t i = 0; i < gate->edge_count; i++) {
        const struct edge *edge = &gate->edges[i];
        bool is_first = at == edge->joints[0];
        if (!is_first && at != edge->joints[1]) continue;
        uint32_t partner = edge->joints[is_first];
        int32_t sign = is_first ? 1 : edge->sign, partner_sign = is_first ? edge->sign : 1;
        /* A joint later in order has not moved yet: its braking path is reserved. */
        int64_t reserved = peak(gate, now, partner, partner_sign, partner > at);
        bound(limits, sign, edge->most - sign * position - reserved, POSE, &low, &high);
    }
    return nearest(asked, low, high);
}

/* The step of a joint towards its goal. */
static struct bound step(const struct gate *gate, const struct gate_state *now, uint32_t at, int32_t goal, bool is_free) {
    const struct limits *limits = &gate->joints[at];
    int32_t wanted = goal - now->position[at], drift = goal - now->goal[at];
    drift = drift < -limits->rate ? -limits->rate : drift > limits->rate ? limits->rate : drift;
    int32_t left = wanted - drift;
    int32_t far = (int32_t)reach(limits, left < 0 ? -(int64_t)left : left);
    int32_t asked = drift + (left < 0 ? -far : far);
    if (is_free) {
        struct bound low, high, found;
        own_bounds(limits, now->step[at], &low, &high);
        found = nearest(asked, low, high);
        int32_t position = now->position[at];
        int32_t distance = found.step > 0 ? limits->most - position : position - limits->least;
        if (found.step == 0 || distance >= limits->clearance) return found;
    }
    return admit(gate, now, at, asked);
}

/* Limits the targets in place; the limits that acted, or -1 if a target is not finite. */
int32_t NAME(c_gate)(const struct gate *restrict gate, struct gate_state *restrict state, float *restrict target) {
    uint32_t status = 0;
    bool in_range = true;
    for (int i = 0; i < JOINTS; i++) {
        const float *ends = gate->joints[i].ends;
        in_range = in_range && target[i] >= ends[0] && target[i] <= ends[1];
    }
    if (!in_range) {
        for (int i = 0; i < JOINTS; i++) {
            if (!__builtin_isfinite(target[i])) return -1;
        }
        for (int i = 0; i < JOINTS; i++) {
            const float *ends = gate->joints[i].ends;
            if (target[i] < ends[0]) target[i] = ends[0], status |= RANGE;
            else if (target[i] > ends[1]) target[i] = ends[1], status |= RANGE;
        }
    }
    int32_t aimed[JOINTS], goal[JOINTS];
    for (int i = 0; i < JOINTS; i++) aimed[i] = goal[i] = (int32_t)(target[i] * STEPS);

    /* Pose envelope: each of the two joints takes half of the excess. */
    uint32_t near = 0;
    for (uint32_t i = 0; i < gate->edge_count; i++) {
        const struct edge *edge = &gate->edges[i];
        int32_t wanted = sum(edge, goal);
        if (wanted > edge->most) {
            int64_t half = ((int64_t)wanted - edge->most + 1) / 2;
            uint32_t first = edge->joints[0], second = edge->joints[1];
            goal[first] = hold(&gate->joints[first], goal[first] - half);
            goal[second] = hold(&gate->joints[second], goal[second] - edge->sign * half);
            status |= POSE;
        }
        if (sum(edge, state->position) > edge->far) near |= 1u << edge->joints[0] | 1u << edge->joints[1];
    }

    /* Rate, acceleration and braking: joint by joint, with the new steps of the joints before it. */
    for (uint32_t at = 0; at < JOINTS; at++) {
        const struct limits *limits = &gate->joints[at];
        int32_t position = state->position[at], wanted = goal[at] - position, change = wanted - state->step[at];
        bool is_free = (near >> at & 1) == 0;
        int32_t distance = wanted < 0 ? position - limits->least : limits->most - position;
        bool is_allowed = is_free && position == state->goal[at] && (wanted < 0 ? -wanted : wanted) <= limits->rate &&
                          (uint32_t)(change < 0 ? -change : change) <= limits->acceleration &&
                          distance >= limits->clearance;
        int32_t taken = wanted;
        if (!is_allowed) {
            struct bound found = step(gate, state, at, goal[at], is_free);
            if (found.step != wanted) status |= found.why;
            taken = found.step;
        }
        state->step[at] = taken;
        state->position[at] = position + taken;
        state->goal[at] = goal[at];
    }

    /* The target itself if the joint is on it, else the position. */
    for (int i = 0; i < JOINTS; i++) {
        if (state->position[i] != aimed[i]) target[i] = (float)state->position[i] / STEPS;
    }
    return (int32_t)status;
}

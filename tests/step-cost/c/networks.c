/* One Runge-Kutta step of the thesis' network and of R1, as cpg-core computes it: in units of half a step, with folded constants and the stages of
   the displacement collapsed (Nystrom). The order of operations is that of the Rust code, so that without contraction the results are equal bit for
   bit. Compiled twice, with and without contraction: NAME adds the ending. */

enum { JOINTS = 4 };

struct state {
    float x[JOINTS], v[JOINTS];
    /* Bounds of x and v. */
    float limit_x[JOINTS], limit_v[JOINTS];
};

struct thesis {
    struct state state;
    float damping[JOINTS], cubic[JOINTS], spring[JOINTS];
    /* On joint i: from the other side, from the other joint of the leg. */
    float difference[JOINTS], product[JOINTS];
};

struct r1 {
    struct state state;
    float damping[JOINTS];
    float cubic, spring;
    /* Left and right hip, left and right knee, left leg, right leg. */
    float link_v[JOINTS], link_x[JOINTS];
};

static inline float held(float value, float limit) {
    return value > limit ? limit : value < -limit ? -limit : value;
}

static inline void thesis_field(const struct thesis *n, const float *x, const float *v, float *a) {
    for (int i = 0; i < JOINTS; i++) {
        a[i] = (n->damping[i] - v[i] * v[i] * n->cubic[i]) * v[i] - x[i] * n->spring[i];
    }
    a[0] -= v[1] * n->difference[0];
    a[1] -= v[0] * n->difference[1];
    a[2] -= v[3] * n->difference[2];
    a[3] -= v[2] * n->difference[3];
    a[0] += v[2] * x[2] * n->product[0];
    a[2] += v[0] * x[0] * n->product[2];
    a[1] += v[3] * x[3] * n->product[1];
    a[3] += v[1] * x[1] * n->product[3];
}

static inline void link(const struct r1 *n, int link, int i, int j, const float *x, const float *v, float *a) {
    a[i] += v[j] * n->link_v[link] - x[j] * n->link_x[link];
    a[j] += v[i] * n->link_v[link] + x[i] * n->link_x[link];
}

static inline void r1_field(const struct r1 *n, const float *x, const float *v, float *a) {
    for (int i = 0; i < JOINTS; i++) {
        a[i] = (n->damping[i] - v[i] * v[i] * n->cubic) * v[i] - x[i] * n->spring;
    }
    link(n, 0, 0, 1, x, v, a);
    link(n, 1, 2, 3, x, v, a);
    link(n, 2, 0, 2, x, v, a);
    link(n, 3, 1, 3, x, v, a);
}

/* A step of a network, by its vector field. */
#define STEP(FIELD)                                                                                                    \
    float *x = n->state.x, *v = n->state.v;                                                                            \
    float k1[JOINTS], k2[JOINTS], k3[JOINTS], k4[JOINTS], x2[JOINTS], at[JOINTS], v3[JOINTS];                          \
    const float third = 1.0f / 3.0f, two_thirds = 2.0f / 3.0f;                                                         \
    FIELD(n, x, v, k1);                                                                                                \
    for (int i = 0; i < JOINTS; i++) x2[i] = x[i] + v[i], at[i] = v[i] + k1[i];                                        \
    FIELD(n, x2, at, k2);                                                                                              \
    for (int i = 0; i < JOINTS; i++) v3[i] = v[i] + k2[i], at[i] = x2[i] + k1[i];                                      \
    FIELD(n, at, v3, k3);                                                                                              \
    for (int i = 0; i < JOINTS; i++) at[i] = x[i] + v3[i] + v3[i], x2[i] = v[i] + k3[i] + k3[i];                       \
    FIELD(n, at, x2, k4);                                                                                              \
    for (int i = 0; i < JOINTS; i++) {                                                                                 \
        float middle = k2[i] + k3[i], first = k1[i] + middle, all = first + middle + k4[i];                            \
        x[i] = held(x[i] + v[i] + v[i] + first * two_thirds, n->state.limit_x[i]);                                     \
        v[i] = held(v[i] + all * third, n->state.limit_v[i]);                                                          \
    }

void NAME(c_thesis)(struct thesis *restrict n) { STEP(thesis_field) }

void NAME(c_r1)(struct r1 *restrict n) { STEP(r1_field) }

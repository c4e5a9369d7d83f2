//! An integrator and a judge of return that share nothing with the certificate: the equations as printed, plain Runge-Kutta of another
//! step, no bounds, no Newton, no matrices.

use generator_file::file::{PhaseCoupledSet, ThesisSet};

/// Displacement of each joint, then velocity of each.
pub(crate) type State = [f64; 8];

/// Joints of the links of R1: hips, knees, left leg, right leg.
const LINKS: [(usize, usize); 4] = [(0, 1), (2, 3), (0, 2), (1, 3)];

/// Right-hand side of a network, in its own units.
pub(crate) enum Equations {
    /// u' = w v, v' = w [eps (1 - 4/3 v^2) v - u + sum kap (cos(phi_i - phi_j) v_j - sin(phi_i - phi_j) u_j - v_i)].
    /// Of each link, kap, and sine and cosine of the difference of its phases.
    PhaseCoupled { w: f64, eps: f64, links: [(f64, f64, f64); 4] },
    /// Equations 13 to 16 of the thesis, about the offsets.
    Thesis { alpha: [f64; 4], p: [f64; 4], mu: [f64; 4], difference: [[f64; 2]; 2], product: [[f64; 2]; 2] },
}

impl Equations {
    /// Of the set of a generator file, and the state from which it starts.
    pub(crate) fn phase_coupled(set: &PhaseCoupledSet) -> (Self, State) {
        let phase = set.joints.map(|joint| f64::from(joint.phase_deg).to_radians());
        let start = std::array::from_fn(|i| {
            let lead = phase[i % 4] - phase[0];
            if i < 4 { lead.cos() } else { -lead.sin() }
        });
        let w = std::f64::consts::TAU / f64::from(set.natural_period_s);
        let links = std::array::from_fn(|link| {
            let (i, j) = LINKS[link];
            let (sin, cos) = (phase[i] - phase[j]).sin_cos();
            (f64::from(set.coupling[link]), sin, cos)
        });
        (Self::PhaseCoupled { w, eps: f64::from(set.nonlinearity), links }, start)
    }

    /// As [`Equations::phase_coupled`]; the network starts on the cycle of harmonic balance.
    pub(crate) fn thesis(set: &ThesisSet) -> (Self, State) {
        let each = |of: fn(&generator_file::file::ThesisJoint) -> f32| set.joints.map(|joint| f64::from(of(&joint)));
        let (alpha, p, mu) = (each(|j| j.alpha_per_s), each(|j| j.p_s2_per_deg2), each(|j| j.mu_rad_per_s));
        let difference = set.difference_per_s.map(|pair| pair.map(f64::from));
        let start = std::array::from_fn(|i| {
            let joint = i % 4;
            let k = difference[joint / 2][joint % 2].max(0.0);
            let speed = (4.0 * (alpha[joint] + 2.0 * k) / (3.0 * alpha[joint] * p[joint])).sqrt();
            let lead = f64::from(set.joints[joint].start_phase_deg).to_radians();
            if i < 4 { speed / mu[joint] * lead.cos() } else { -speed * lead.sin() }
        });
        let product = set.product_per_deg_s.map(|pair| pair.map(f64::from));
        (Self::Thesis { alpha, p, mu, difference, product }, start)
    }

    pub(crate) fn slope(&self, s: &State) -> State {
        let mut d = [0.0; 8];
        match self {
            Self::PhaseCoupled { w, eps, links } => {
                for i in 0..4 {
                    let (u, v) = (s[i], s[i + 4]);
                    d[i] = w * v;
                    d[i + 4] = w * (eps * (1.0 - 4.0 / 3.0 * v * v) * v - u);
                }
                for ((i, j), (kap, sin, cos)) in LINKS.into_iter().zip(links) {
                    d[i + 4] += w * kap * (cos * s[j + 4] - sin * s[j] - s[i + 4]);
                    // The difference of the phases has the other sign.
                    d[j + 4] += w * kap * (cos * s[i + 4] + sin * s[i] - s[j + 4]);
                }
            }
            Self::Thesis { alpha, p, mu, difference, product } => {
                for i in 0..4 {
                    let (x, z) = (s[i], s[i + 4]);
                    d[i] = z;
                    d[i + 4] = alpha[i] * (1.0 - p[i] * z * z) * z - mu[i] * mu[i] * x;
                }
                for (pair, (a, b)) in [(0, 1), (2, 3)].into_iter().enumerate() {
                    d[a + 4] += difference[pair][0] * (s[a + 4] - s[b + 4]);
                    d[b + 4] += difference[pair][1] * (s[b + 4] - s[a + 4]);
                }
                for (pair, (a, b)) in [(0, 2), (1, 3)].into_iter().enumerate() {
                    d[a + 4] += product[pair][0] * s[b + 4] * s[b];
                    d[b + 4] += product[pair][1] * s[a + 4] * s[a];
                }
            }
        }
        d
    }

    /// As [`Equations::run`]; false if a state comes to three amplitudes of the closed form, or a velocity to where a product link makes
    /// a spring negative: the generator's check then fails, which is a fault.
    fn runs_inside(&self, s: &mut State, h: f64, steps: usize) -> bool {
        let bounds: State = match self {
            Self::PhaseCoupled { .. } => [3.0; 8],
            Self::Thesis { alpha, p, mu, difference, product } => std::array::from_fn(|i| {
                let joint = i % 4;
                let k = difference[joint / 2][joint % 2].max(0.0);
                let speed = 3.0 * (4.0 * (alpha[joint] + 2.0 * k) / (3.0 * alpha[joint] * p[joint])).sqrt();
                // The joint that this one drives, and the gain.
                let (driven, gain) = ((joint + 2) % 4, product[joint % 2][usize::from(joint < 2)].abs());
                let runaway = if gain > 0.0 { mu[driven].powi(2) / gain } else { f64::INFINITY };
                if i < 4 {
                    speed / mu[joint] * (1.0 + (alpha[joint] + 2.0 * k) / mu[joint])
                } else {
                    speed.min(runaway)
                }
            }),
        };
        (0..steps).all(|_| {
            self.run(s, h, 1);
            s.iter().zip(bounds).all(|(x, bound)| x.abs() < bound)
        })
    }

    /// So many steps of `h` seconds.
    pub(crate) fn run(&self, s: &mut State, h: f64, steps: usize) {
        let along = |s: &State, d: &State, by: f64| -> State { std::array::from_fn(|i| s[i] + by * d[i]) };
        for _ in 0..steps {
            let a = self.slope(s);
            let b = self.slope(&along(s, &a, 0.5 * h));
            let c = self.slope(&along(s, &b, 0.5 * h));
            let d = self.slope(&along(s, &c, h));
            for i in 0..8 {
                s[i] += h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]);
            }
        }
    }
}

/// What the judge found. Between `Comes` and `DoesNot` the statistics do not decide.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Judged {
    /// Certainly comes back.
    Comes,
    /// Certainly does not.
    DoesNot,
    /// At the border of a condition.
    Border,
}

/// Splitmix64, uniform from -1 to 1.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    /// From `low` to `high`, evenly in the logarithm.
    pub(crate) fn log(&mut self, low: f64, high: f64) -> f64 {
        low * (high / low).powf(0.5 * (1.0 + self.next()))
    }

    pub(crate) fn from(&mut self, low: f64, high: f64) -> f64 {
        low + 0.5 * (1.0 + self.next()) * (high - low)
    }
}

const STEPS: usize = 230;

/// One stride of the motion, and its sizes.
struct Loop {
    points: Vec<State>,
    size: State,
    period: usize,
}

impl Loop {
    fn distance(&self, s: &State) -> f64 {
        let square = |a: &State, b: &State| (0..8).map(|i| ((a[i] - b[i]) / self.size[i]).powi(2)).sum::<f64>();
        let (mut at, mut least) = (0, f64::INFINITY);
        for (k, point) in self.points.iter().enumerate() {
            let d = square(point, s);
            if d < least {
                (at, least) = (k, d);
            }
        }
        // The motion is straight from point to point.
        let n = self.points.len();
        for other in [(at + 1) % n, (at + n - 1) % n] {
            let (a, b) = (&self.points[at], &self.points[other]);
            let scaled = |i: usize, x: f64| x / self.size[i];
            let dot: f64 = (0..8).map(|i| scaled(i, b[i] - a[i]) * scaled(i, s[i] - a[i])).sum();
            let t = (dot / square(a, b).max(1e-30)).clamp(0.0, 1.0);
            least = least.min(square(&std::array::from_fn(|i| a[i] + t * (b[i] - a[i])), s));
        }
        least.sqrt()
    }
}

/// Judges whether a network comes back to its motion: it repeats, a small difference shrinks by 0.95 or more a stride, every kick of half
/// an amplitude falls to a tenth within 100 strides, and 95 of 100 random states arrive within 200.
pub(crate) fn judge(equations: &Equations, start: State, guess_s: f64, seed: u64) -> (Judged, String) {
    let h = guess_s / STEPS as f64;
    let mut s = start;
    equations.run(&mut s, h, 250 * STEPS);
    // Its period: upward crossings of the first joint.
    let mut marks = vec![];
    let mut probe = s;
    for step in 0..24 * STEPS {
        let before = probe[0];
        equations.run(&mut probe, h, 1);
        if before < 0.0 && probe[0] >= 0.0 {
            marks.push(step as f64 - before / (probe[0] - before));
        }
    }
    if marks.len() < 8 || probe.iter().any(|x| x.is_nan() || x.abs() >= 1e6) {
        return (Judged::DoesNot, "no oscillation".into());
    }
    let own = (marks[marks.len() - 1] - marks[0]) / (marks.len() - 1) as f64;
    // Up to three cycles of the first joint are one stride.
    let mut motion = None;
    for cycles in 1..=3 {
        let period = (own * f64::from(cycles)).round() as usize;
        let mut points = vec![];
        let mut probe = s;
        for _ in 0..period {
            points.push(probe);
            equations.run(&mut probe, h, 1);
        }
        let size = std::array::from_fn(|i| {
            let fold = |(l, u): (f64, f64), p: &State| (l.min(p[i]), u.max(p[i]));
            let (low, high) = points.iter().fold((f64::MAX, f64::MIN), fold);
            (0.5 * (high - low)).max(1e-12)
        });
        if size.iter().any(|x| *x < 1e-6) {
            return (Judged::DoesNot, "a joint is at rest".into());
        }
        let found = Loop { points, size, period };
        let mut late = s;
        equations.run(&mut late, h, 300 * STEPS);
        let mut worst: f64 = 0.0;
        for _ in 0..20 {
            equations.run(&mut late, h, STEPS / 7);
            worst = worst.max(found.distance(&late));
        }
        if worst < 2e-3 {
            motion = Some(found);
            break;
        }
    }
    let Some(motion) = motion else { return (Judged::DoesNot, "it does not repeat".into()) };
    let mut random = Random(seed);
    let contraction = contraction(equations, &motion, s, h, &mut random);
    if contraction > 0.957 {
        return (Judged::DoesNot, format!("contraction {contraction:.4}"));
    }
    let mut border = if contraction > 0.943 { Some(format!("contraction {contraction:.4}")) } else { None };
    // Kicks at other phases than the certificate's.
    let back = |state: State, within: f64, strides: u32| {
        let mut s = state;
        let mut near = 0;
        for _ in 0..strides {
            if !equations.runs_inside(&mut s, h, motion.period) {
                return false;
            }
            near = if motion.distance(&s) < within { near + 1 } else { 0 };
            if near == 3 {
                return true;
            }
        }
        false
    };
    let mut lost = 0;
    let mut kicks = 0;
    for phase in 0..11 {
        for which in 0..18 {
            let mut state = motion.points[(phase * motion.period + 5) / 11 % motion.period];
            if which < 16 {
                state[which / 2] += (if which % 2 == 0 { 0.5 } else { -0.5 }) * motion.size[which / 2];
            } else {
                let by: State = std::array::from_fn(|_| random.next());
                let most = by.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
                (0..8).for_each(|i| state[i] += 0.75 * by[i] / most * motion.size[i]);
            }
            kicks += 1;
            if !back(state, 0.1 * motion.distance(&state), 100) {
                lost += 1;
            }
            if lost == 4 {
                return (Judged::DoesNot, format!("4 of {kicks} kicks lost"));
            }
        }
    }
    if lost > 0 {
        border = Some(format!("{lost} of {kicks} kicks lost"));
    }
    // Random starts, more if the first do not decide.
    let (mut tried, mut arrived) = (0u32, 0u32);
    for most in [200, 1000] {
        while tried < most {
            let state = std::array::from_fn(|i| 1.5 * random.next() * motion.size[i]);
            arrived += u32::from(back(state, 0.05, 200));
            tried += 1;
        }
        let (share, deviation) = (f64::from(arrived) / f64::from(tried), (0.05 * 0.95 / f64::from(tried)).sqrt());
        let words = format!("{arrived} of {tried} starts");
        if share < 0.95 - 3.0 * deviation {
            return (Judged::DoesNot, words);
        }
        if share > 0.95 + 3.0 * deviation {
            break;
        }
        if most == 1000 {
            border = Some(words);
        }
    }
    match border {
        Some(why) => (Judged::Border, why),
        None => (Judged::Comes, format!("contraction {contraction:.4}, {arrived} of {tried} starts")),
    }
}

/// Factor of a small difference in a stride, without its part along the motion: a second motion beside the first, brought near again
/// after every stride.
fn contraction(equations: &Equations, motion: &Loop, s: State, h: f64, random: &mut Random) -> f64 {
    let small = 1e-6;
    let scaled = |d: &State| -> State { std::array::from_fn(|i| d[i] / motion.size[i]) };
    let across = |d: State, at: &State| -> State {
        let along = scaled(&equations.slope(at));
        let dot: f64 = (0..8).map(|i| along[i] * d[i]).sum();
        let length: f64 = along.iter().map(|x| x * x).sum();
        std::array::from_fn(|i| d[i] - dot / length * along[i])
    };
    let norm = |d: &State| d.iter().map(|x| x * x).sum::<f64>().sqrt();
    let mut here = s;
    let mut d = across(std::array::from_fn(|_| random.next()), &here);
    let mut sum = 0.0;
    let (skipped, counted) = (30, 120);
    for stride in 0..skipped + counted {
        let size = norm(&d);
        let mut other: State = std::array::from_fn(|i| here[i] + small * d[i] / size * motion.size[i]);
        equations.run(&mut here, h, motion.period);
        equations.run(&mut other, h, motion.period);
        d = across(scaled(&std::array::from_fn(|i| (other[i] - here[i]) / small)), &here);
        if stride >= skipped {
            sum += norm(&d).ln();
        }
    }
    (sum / f64::from(counted)).exp()
}

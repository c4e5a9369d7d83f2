//! Vectors of three numbers, and trajectories of them.

pub(super) type Vector = [f64; 3];

/// Position of a point in each frame; NaN where the point is missing.
pub(crate) type Track = Vec<Vector>;

pub(super) fn add(a: Vector, b: Vector) -> Vector {
    std::array::from_fn(|n| a[n] + b[n])
}

pub(super) fn sub(a: Vector, b: Vector) -> Vector {
    std::array::from_fn(|n| a[n] - b[n])
}

pub(super) fn scale(a: Vector, by: f64) -> Vector {
    a.map(|value| value * by)
}

pub(super) fn dot(a: Vector, b: Vector) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

pub(super) fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub(super) fn length(a: Vector) -> f64 {
    dot(a, a).sqrt()
}

/// The direction of a vector; `None` for a vector of length 0.
pub(super) fn unit(a: Vector) -> Option<Vector> {
    let length = length(a);
    (length.is_finite() && length > 0.0).then(|| a.map(|value| value / length))
}

/// A vector without its part along `axis`, which has length 1.
pub(super) fn square_to(a: Vector, axis: Vector) -> Vector {
    sub(a, scale(axis, dot(a, axis)))
}

/// The mean of trajectories, point by point; missing where one of them is.
pub(super) fn mean_track(points: &[usize], track: impl FnMut(usize) -> Track) -> Track {
    let share = 1.0 / points.len() as f64;
    let mut tracks = points.iter().copied().map(track);
    let mut sum = tracks.next().unwrap_or_default();
    for other in tracks {
        sum.iter_mut().zip(other).for_each(|(a, b)| *a = add(*a, b));
    }
    sum.iter_mut().for_each(|point| *point = scale(*point, share));
    sum
}

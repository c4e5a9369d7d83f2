//! Makes the content of every sample.

mod generators;
mod layouts;
mod lines;
mod motion;
mod random;
mod recordings;
mod robot;
mod sensor;

/// Name and content of every sample, in the order of the list of `footfall sample`.
pub(crate) fn all() -> Vec<(&'static str, Vec<u8>)> {
    vec![
        ("walk.csv", recordings::csv().into_bytes()),
        ("walk.mot", recordings::mot().into_bytes()),
        ("walk.c3d", recordings::c3d()),
        ("ankles.mot", recordings::with_ankles().into_bytes()),
        ("oscilloscope.csv", recordings::oscilloscope().into_bytes()),
        ("rows.csv", sensor::rows().into_bytes()),
        ("sensor.toml", sensor::table().into_bytes()),
        ("edges.csv", lines::coded().into_bytes()),
        ("line-board.csv", lines::plain(lines::BOARD).into_bytes()),
        ("line-recorder.csv", lines::plain(lines::RECORDER).into_bytes()),
        ("generator.toml", generators::shape().into_bytes()),
        ("follower.toml", generators::follower().into_bytes()),
        ("robot.toml", robot::small().into_bytes()),
        ("graph.txt", GRAPH.as_bytes().to_vec()),
        ("foxglove-layout.json", layouts::foxglove().into_bytes()),
        ("plotjuggler-layout.xml", layouts::plotjuggler().into_bytes()),
    ]
}

const GRAPH: &str = "\
# Six legs of a hexapod as a ring, for `footfall smer`. Everything after a number sign is a comment.
# All reversibilities are 1. An edge `a -> b` points to b: all its tokens lie at b, which operates before a.
left_front -> left_middle
left_middle -> left_hind
left_hind -> right_hind
right_hind -> right_middle
right_front -> right_middle
left_front -> right_front
";

//! Names of flash records that a command makes without `--name`: those of the files that they are made of.

use std::path::Path;

use joint_loop::RecordName;

use super::sensors::SensorArgument;

/// The name of a file without its folder and ending, cut to the length of a name.
///
/// ```
/// use footfall::options::record_name::of_file;
/// assert_eq!(of_file("walks/normal walk.toml".as_ref()).as_str(), "normal walk");
/// ```
#[must_use]
pub fn of_file(path: &Path) -> RecordName {
    RecordName::cut(&stem(path))
}

/// The names of the sensor files in order, or of the joints that have none, cut to the length of a name.
///
/// ```
/// use footfall::options::record_name::of_sensors;
/// let arguments = ["left_hip=ann/hip.toml", "left_knee"].map(|text| text.parse().expect("a joint"));
/// assert_eq!(of_sensors(&arguments).as_str(), "hip left_knee");
/// ```
#[must_use]
pub fn of_sensors(arguments: &[SensorArgument]) -> RecordName {
    let name = |argument: &SensorArgument| {
        argument.calibration.as_deref().map_or_else(|| argument.joint.name().to_owned(), stem)
    };
    RecordName::cut(&arguments.iter().map(name).collect::<Vec<_>>().join(" "))
}

fn stem(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

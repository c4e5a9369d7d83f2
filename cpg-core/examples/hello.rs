//! One stride of the default walk as a table: `cargo run -p cpg-core --example hello`.

use cpg_core::Generator;
use cpg_core::gait::default_walk::default_walk;
use joint_units::{Joint, Period};

fn main() -> Result<(), cpg_core::BuildError> {
    let mut walk = default_walk(Period::MILLISECOND)?;
    print!("phase");
    for joint in Joint::ALL {
        print!(" {:>11}", joint.name());
    }
    println!("   (degrees)");
    for tick in 0..1100 {
        if tick % 110 == 0 {
            print!("{:5.2}", walk.phase().cycles());
            for angle in walk.angles() {
                print!(" {:11.1}", angle.degrees());
            }
            println!();
        }
        walk.step();
    }
    Ok(())
}

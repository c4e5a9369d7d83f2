//! The recordings that the family was fitted to, with source, licence and SHA-256.
//!
//! All are of healthy adults, with four joints and times in seconds. Left out are recordings whose licence does not allow it (GPL) or is not
//! known, those of patients, of a trunk that sways on purpose and of a band between the feet, means of groups, and those of one knee.

use crate::gait::family::Member;

/// A recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Source {
    /// Name of the file without `.csv`: time in seconds and four joints in degrees, flexion positive.
    pub name: &'static str,
    /// Who was recorded; recordings of one person have the same text.
    pub person: &'static str,
    /// The member that is fitted to it: [`Member::Walk`] or [`Member::RunUnscaled`].
    pub member: Member,
    /// Repository or package that publishes it, and the paper where it is known.
    pub origin: &'static str,
    /// Licence under which it is published there.
    pub licence: &'static str,
    /// SHA-256 of the file, in hex.
    pub sha256: &'static str,
}

const OPENSIM: &str = "opensim-org/opensim-core";
const NIMBLE: &str = "keenon/nimblephysics";

/// Every recording.
pub const SOURCES: [Source; 15] = [
    Source {
        name: "osim_subject01_walk",
        person: "opensim subject01",
        member: Member::Walk,
        origin: OPENSIM,
        licence: "Apache-2.0",
        sha256: "467fadc97c97a1bbd9f6ab34abce2c950b7cbe7d8d1d74d1d6528f2eac110737",
    },
    Source {
        name: "biomechzoo_adult_level",
        person: "biomechzoo subject07",
        member: Member::Walk,
        origin: "PhilD001/biomechZoo",
        licence: "Apache-2.0",
        sha256: "b346ee9f57fb56948d2edef93d778797d7923b177f213466f6c8024fa7279890",
    },
    Source {
        name: "opencap_subject4_walking1",
        person: "opencap subject4",
        member: Member::Walk,
        origin: NIMBLE,
        licence: "BSD-2-Clause",
        sha256: "51369393704624941bef59db2b2c91476fae403b5ae56886a24fa31ef2206bb5",
    },
    Source {
        name: "opencap_subject4_walking2",
        person: "opencap subject4",
        member: Member::Walk,
        origin: NIMBLE,
        licence: "BSD-2-Clause",
        sha256: "0de0b8945f6dc31a8630e90a749880f9a9fd90f514591130eb21811e72c6bd04",
    },
    Source {
        name: "opencap_subject4_walking4",
        person: "opencap subject4",
        member: Member::Walk,
        origin: NIMBLE,
        licence: "BSD-2-Clause",
        sha256: "20c1ea1f11c2c5433a34d1c446ee197abc049af8b21dab394087ba257f3510ef",
    },
    Source {
        name: "gaitkit_fukuchi_healthy",
        person: "fukuchi",
        member: Member::Walk,
        origin: "gaitkit 1.5.0; Fukuchi et al. 2018",
        licence: "CC BY 4.0",
        sha256: "6982ff1d43bfb00fe66873ee02ed704bcb4fd61b7d51b69eed92e684b20ce7f4",
    },
    Source {
        name: "osim_c3d_treadmill_walking2",
        person: "opensim treadmill",
        member: Member::Walk,
        origin: OPENSIM,
        licence: "Apache-2.0",
        sha256: "411fbe31adbcb7da3da33815bf6235231d2c0f3102720d454d5d7e0d58713678",
    },
    Source {
        name: "osim_c3d_treadmill_walking5",
        person: "opensim treadmill",
        member: Member::Walk,
        origin: OPENSIM,
        licence: "Apache-2.0",
        sha256: "cb9b77f27368de5a843fe93ab850a28e473c288fe37a1207088ceea92741934e",
    },
    Source {
        name: "osim_c3d_treadmill_test_walking",
        person: "opensim treadmill",
        member: Member::Walk,
        origin: OPENSIM,
        licence: "Apache-2.0",
        sha256: "fc8e8ffc4d0883af595a9b2e7b098d975fec95d340c1d227c095f2786e30b85f",
    },
    Source {
        name: "camargo_levelground_ccw_fast_walk",
        person: "camargo",
        member: Member::Walk,
        origin: "keenon/nimblephysics; Camargo et al. 2021",
        licence: "BSD-2-Clause",
        sha256: "c5a56d823b594cd398b738f45933c0b546960f8b5e42c6f8acb98747aa040b42",
    },
    Source {
        name: "hamner_run200",
        person: "hamner",
        member: Member::RunUnscaled,
        origin: "keenon/nimblephysics; Hamner and Delp 2013",
        licence: "BSD-2-Clause",
        sha256: "63c455bbc3879c951104a197ba800be7e9690514ad0271e4a5cb8f6514afee8c",
    },
    Source {
        name: "hamner_run300",
        person: "hamner",
        member: Member::RunUnscaled,
        origin: "keenon/nimblephysics; Hamner and Delp 2013",
        licence: "BSD-2-Clause",
        sha256: "f39e0d5eaca8cfa521cf7218f4aa9f3a0ca677e184af0e84a90e6bd03a645821",
    },
    Source {
        name: "dorn_sprinter_run0350cms",
        person: "dorn",
        member: Member::RunUnscaled,
        origin: "keenon/nimblephysics; Dorn et al. 2012",
        licence: "BSD-2-Clause",
        sha256: "f9256357fda4a3784d9abbcf820c2853da30c4c4283097f2bb708b415da18bad",
    },
    Source {
        name: "dorn_sprinter_run0500cms",
        person: "dorn",
        member: Member::RunUnscaled,
        origin: "keenon/nimblephysics; Dorn et al. 2012",
        licence: "BSD-2-Clause",
        sha256: "2865408dabfffeb5e9528fa594f1d8a1f0105753375f7b0717a068bdeae19605",
    },
    Source {
        name: "welker_007_run_natural",
        person: "welker",
        member: Member::RunUnscaled,
        origin: NIMBLE,
        licence: "BSD-2-Clause",
        sha256: "1bca25144399f32660223c2dcbded94e77120c28baa2e911cc49bb3dba83e844",
    },
];

/// The recording of a start and a stop that [`crate::gait::family::START`] and [`crate::gait::family::STOP`] come from: one person, one trial.
pub const START_AND_STOP: Source = Source {
    name: "camargo_levelground_ccw_fast_full_with_artefacts",
    person: "camargo",
    member: Member::Walk,
    origin: "keenon/nimblephysics; Camargo et al. 2021",
    licence: "BSD-2-Clause",
    sha256: "3a821367739a5532a042883ca3c521aebd4160be922ed3228dab92db04792a37",
};

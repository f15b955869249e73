//! Numbers out of their range on the command line: exit code 2 and a sentence that names the flag, before any work.

use std::process::Command;

#[test]
fn numbers_out_of_range_end_with_code_2() {
    for (flag, values) in [
        ("--epsilon", &["nan", "inf", "-1", "1e39", "x", ""][..]),
        ("--min-area", &["nan", "-0.1"]),
        ("--samples", &["0", "4097", "-1", "1.5"]),
        ("--max-steps", &["0", "4294967296"]),
        ("--seed", &["-1", "18446744073709551616"]),
        ("--time-limit", &["-1", "nan", "1e30"]),
        ("--memory-limit", &["0", "1099511627777"]),
        ("--threads", &["0", "1025"]),
        ("--max-reflectance", &["-0.1", "1.1", "nan"]),
        ("--exposure", &["61", "nan"]),
        ("--emission-scale", &["-1", "inf"]),
        ("--reference", &["paths=0", "paths=-1", "paths=4294967296"]),
        #[cfg(feature = "viewer")]
        ("--size", &["0x1", "1x32769", "1", "axb"]),
        #[cfg(feature = "viewer")]
        ("--camera-view-angle", &["0", "171", "nan", "inf"]),
        #[cfg(feature = "viewer")]
        ("--camera-view-up", &["0,0,0", "nan,0,1"]),
        #[cfg(feature = "viewer")]
        ("--camera-position", &["1,2", "inf,0,0"]),
        #[cfg(feature = "viewer")]
        ("--range", &["0,1e300", "2,1", "-1,1"]),
        #[cfg(feature = "viewer")]
        ("--clusters", &["-1", "4294967296"]),
    ] {
        for value in values {
            let output = Command::new(env!("CARGO_BIN_EXE_vecrad"))
                .args(["solve", "--scene", "plates", &format!("{flag}={value}")])
                .output()
                .unwrap();
            let said = String::from_utf8(output.stderr).unwrap();
            assert_eq!(output.status.code(), Some(2), "{flag} {value}: {said}");
            let first = said.lines().next().unwrap();
            assert!(
                first.starts_with("error: ") && first.contains(flag),
                "{said}"
            );
        }
    }
}

//! The robot files that come with the program, and what is said of bad ones.

use hippocamp::config;
use std::path::Path;

#[test]
fn load() {
    for name in ["horse", "horse-dynamixel", "thoroughbred"] {
        let path = format!("{}/config/{name}.toml", env!("CARGO_MANIFEST_DIR"));
        match config::load(Path::new(&path)) {
            Ok(file) => println!("{:#?}", file.robot),
            Err(error) => panic!("{error}"),
        }
    }
}

//! Compiles `osteon/v1/*.proto` in pure Rust: no `protoc` is needed.

use std::env;
use std::fs;
use std::path::PathBuf;

use prost::Message as _;
use tonic_prost_build::Config;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let files = ["specification", "results", "jobs", "workers"];
    let files = files.map(|name| format!("osteon/v1/{name}.proto"));
    for file in &files {
        println!("cargo:rerun-if-changed={file}");
    }
    let descriptors = protox::compile(files, ["."])?;
    let out_dir = PathBuf::from(env::var("OUT_DIR")?);
    fs::write(out_dir.join("osteon.v1.bin"), descriptors.encode_to_vec())?;
    let mut config = Config::new();
    config.enable_type_names();
    tonic_prost_build::configure().compile_fds_with_config(descriptors, config)?;
    Ok(())
}

//! Names the version of the interface inside the shared library, so that programs find the one they were linked with.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed=include/cbvh.h");
    let system = std::env::var("CARGO_CFG_TARGET_OS").unwrap_or_default();
    let abi = match abi() {
        Ok(abi) => abi,
        Err(message) => {
            println!("cargo::error=include/cbvh.h: {message}");
            return;
        }
    };
    if system == "linux" || system.ends_with("bsd") || system == "android" {
        println!("cargo::rustc-cdylib-link-arg=-Wl,-soname,libcbvh.so.{abi}");
        // Threads may still be in the library when a program closes it: it stays in memory.
        println!("cargo::rustc-cdylib-link-arg=-Wl,-z,nodelete");
    }
    if system == "macos" {
        println!("cargo::rustc-cdylib-link-arg=-Wl,-install_name,@rpath/libcbvh.{abi}.dylib");
    }
}

/// The number that the header states.
fn abi() -> Result<u32, String> {
    let header = std::fs::read_to_string("include/cbvh.h").map_err(|error| error.to_string())?;
    let stated = header.lines().find_map(|line| line.strip_prefix("#define CBVH_ABI "));
    let stated = stated.ok_or("expected a line `#define CBVH_ABI`, found none")?;
    stated.trim().parse().map_err(|_| format!("CBVH_ABI: expected a number, found {stated}"))
}

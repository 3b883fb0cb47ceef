//! Names the version of the interface inside the shared library, so that programs find the one they were linked with.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    let system = std::env::var("CARGO_CFG_TARGET_OS").unwrap_or_default();
    if system == "linux" || system.ends_with("bsd") || system == "android" {
        println!("cargo::rustc-cdylib-link-arg=-Wl,-soname,libcbvh.so.0");
    }
    if system == "macos" {
        println!("cargo::rustc-cdylib-link-arg=-Wl,-install_name,@rpath/libcbvh.0.dylib");
    }
}

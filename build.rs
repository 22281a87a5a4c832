//! Finds and binds Embree.

fn main() {}

//! The `littoral` command.

fn main() {
    println!("littoral");
}

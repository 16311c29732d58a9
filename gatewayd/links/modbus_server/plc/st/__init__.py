"""What the bodies of structured text say of registers: joined and split, packed and unpacked, polled and watched."""

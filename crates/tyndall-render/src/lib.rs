//! Light transport: committed world, path loop, direct light, film and AOVs, sessions.

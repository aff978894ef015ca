#pragma once

/// Before a loop: no turn of it writes what another reads, though the compiler cannot see that; it may run several
/// turns at a time.
#if defined(__clang__)
#define MOCAP_INDEPENDENT_TURNS _Pragma("clang loop vectorize(assume_safety)")
#else
#define MOCAP_INDEPENDENT_TURNS _Pragma("GCC ivdep")
#endif

/// Before a function of such loops: it is built for wider registers too, and the machine takes what it has. The numbers
/// are the same: nothing is contracted or reordered. Not with sanitizers, which are not ready when the choice is made.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define MOCAP_WIDE __attribute__((target_clones("avx2", "default")))
/// The same for bits: to count zeros, and to shift by a variable, takes one instruction each from x86-64-v3 on.
#define MOCAP_BITS __attribute__((target_clones("arch=x86-64-v3", "default")))
#else
#define MOCAP_WIDE
#define MOCAP_BITS
#endif

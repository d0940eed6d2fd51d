#pragma once

// Marks a function that is compiled once per instruction set, with all that it calls inlined; the version is chosen
// when the program loads. None uses fused multiply-adds, so all give the same bits: a test looks for them in the code,
// as GCC 12 makes some of scalars in spite of -ffp-contract=off. The thread sanitizer is not ready yet when the choice
// is made, so its build has one version.
#ifdef __SANITIZE_THREAD__
#define LAYFIGURE_KERNEL
#else
#define LAYFIGURE_KERNEL __attribute__((flatten, target_clones("default", "arch=x86-64-v3", "arch=x86-64-v4")))
#endif

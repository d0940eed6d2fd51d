#pragma once

// Marks a function that is compiled once per instruction set, with all that it calls inlined; the version is chosen
// when the program loads. None uses fused multiply-adds, so all give the same bits. The thread sanitizer is not ready
// yet when the choice is made, so its build has one version.
#ifdef __SANITIZE_THREAD__
#define LAYFIGURE_KERNEL
#else
#define LAYFIGURE_KERNEL __attribute__((flatten, target_clones("default", "arch=x86-64-v3", "arch=x86-64-v4")))
#endif

/// What the shared library shows to a game; all else in it is hidden.
#pragma once

#if __cplusplus < 202002L
#error "Cradle's headers are C++20: compile with -std=c++20"
#endif

#define CRADLE_EXPORT __attribute__((visibility("default")))

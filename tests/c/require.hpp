// What the C++ programs here claim: the first condition that does not hold is told, and ends them.
#pragma once

#include <cstdio>

#define REQUIRE(condition)                                                        \
    do {                                                                          \
        if (!(condition)) {                                                       \
            std::fprintf(stderr, "%s:%d: %s\n", __FILE__, __LINE__, #condition);  \
            return 1;                                                             \
        }                                                                         \
    } while (false)

/* What the test programs share: they end with 1 at the first thing that is not as it should be. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "rtsl.h"

#define CHECK(condition)                                                                           \
    do {                                                                                           \
        if (!(condition)) {                                                                        \
            fprintf(stderr, "%s:%d: not true: %s\n%s\n", __FILE__, __LINE__, #condition, rtsl_last_error()); \
            exit(1);                                                                               \
        }                                                                                          \
    } while (0)

/* The call goes well. */
#define OK(call) CHECK((call) == RTSL_RESULT_OK)

/* The call fails with this result and a message that has this part. */
#define FAILS(call, result, part)                                                                  \
    do {                                                                                           \
        CHECK((call) == (result));                                                                 \
        CHECK(strstr(rtsl_last_error(), (part)) != NULL);                                          \
    } while (0)

// Marks what the shared library exports.
#pragma once

#if defined(MORPHRAY_STATIC)
#define MORPHRAY_API
#elif defined(__GNUC__)
#define MORPHRAY_API __attribute__((visibility("default")))
#else
#define MORPHRAY_API
#endif

// The only include of Vulkan. Its functions are pointers that volk fills at run time, so that the
// program starts without a Vulkan library and tests can make any call fail.
#pragma once

#define VK_NO_PROTOTYPES
#include <volk.h>

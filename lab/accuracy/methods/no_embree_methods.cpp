#include "lab/accuracy/methods/method.h"

namespace mray::accuracy {

std::vector<Method> embree_methods(const ChartScene&) { return {}; }

}  // namespace mray::accuracy

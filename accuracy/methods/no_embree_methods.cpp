#include "accuracy/methods/method.h"

namespace morphray::accuracy {

std::vector<Method> embree_methods(const ChartScene&) { return {}; }

}  // namespace morphray::accuracy

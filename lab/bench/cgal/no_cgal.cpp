#include "lab/bench/cgal/cgal_tree.h"

namespace mray::bench {

std::unique_ptr<CgalTree> make_cgal_tree(const BenchScene&) { return nullptr; }

}  // namespace mray::bench

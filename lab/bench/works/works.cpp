#include "lab/bench/works/works.h"

namespace mray::bench {

Row row_of(const Rig& rig, const BenchScene& scene, const char* work) {
    Row row;
    row.scene = scene.name;
    row.triangles = scene.topology().triangles.size();
    row.view = name_of(scene.view_kind);
    row.work = work;
    row.threads = rig.threads;
    return row;
}

Row row_of(const Rig& rig, const BenchScene& scene, const TraceWork& work,
           const TraceAnswers& answers) {
    Row row = row_of(rig, scene, work.name().c_str());
    row.rays = work.active_count;
    if (row.rays != 0) {
        row.hit_share =
            static_cast<double>(count_hits(work, answers)) / static_cast<double>(row.rays);
    }
    return row;
}

}  // namespace mray::bench

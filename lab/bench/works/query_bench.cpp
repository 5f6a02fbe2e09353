#include <fmt/format.h>

#include <algorithm>
#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "common/base/thread_arena.h"
#include "common/scene/camera_setup.h"
#include "lab/bench/cgal/cgal_tree.h"
#include "lab/bench/embree/embree_questions.h"
#include "lab/bench/questions/question_work.h"
#include "lab/bench/user_scene.h"
#include "lab/bench/works/works.h"

namespace mray::bench {
namespace {

/// A peer's way to ask. Of a group the fastest makes a row.
struct QuestionPeer {
    std::string name;
    std::string group;
    std::function<void()> run;
    /// Enters how its answers to its last run differ from ours.
    std::function<void(Row&)> compare;
};

/// The fastest of each group, in the order of the groups' first peers. samples[0] are ours.
std::vector<std::size_t> fastest_of_groups(std::span<const QuestionPeer> peers,
                                           std::span<const Samples> samples) {
    std::vector<std::size_t> fastest;
    for (std::size_t i = 0; i < peers.size(); ++i) {
        const auto same = std::find_if(fastest.begin(), fastest.end(), [&](std::size_t other) {
            return peers[other].group == peers[i].group;
        });
        if (same == fastest.end()) {
            fastest.push_back(i);
        } else if (median(samples[1 + i]) < median(samples[1 + *same])) {
            *same = i;
        }
    }
    return fastest;
}

double share_of(std::size_t part, std::size_t all) {
    return static_cast<double>(part) / static_cast<double>(all);
}

/// The same scene behind the public interface, on one target, and as the peers have it.
class Questions {
public:
    Questions(const Rig& rig, const BenchScene& scene)
        : rig_(rig),
          scene_(scene),
          points_(to_user(scene.positions)),
          mesh_(scene.topology(), scene.positions),
          arena_(rig.threads),
          cgal_(make_cgal_tree(scene)) {
        for (const bool robust : {true, false}) {
            for (const EmbreeDevice& device : rig.devices)
                embree_.emplace_back(device, mesh_, robust, query_count());
        }
    }

    /// As many as the image has pixels.
    std::size_t query_count() const {
        return std::size_t{scene_.params.width} * scene_.params.height;
    }

    void ask_all(const SimdTarget& target) {
        const auto& triangles = scene_.topology().triangles;
        const morphray::Scene scene = morphray::Scene::build(
            {.positions = morphray::packed(points_),
             .triangles = {&triangles.data()->x, 3 * triangles.size()}},
            morphray::Device::cpu({.threads = rig_.threads, .simd = target.name}),
            {.bounds = kUserBounds, .update = morphray::Refit{}});
        const std::vector<vec3> near = points_near_surface(scene_, query_count());
        const std::vector<vec3> in_box = points_in_box(scene_, query_count());
        ask_closest(scene, target, "near", near);
        ask_closest(scene, target, "in box", in_box);
        ask_closest(scene, target, "near, sorted", sorted_by_place(near));
        ask_closest(scene, target, "in box, sorted", sorted_by_place(in_box));
        ask_count(scene, target, "camera", camera_rays(scene_.params), true);
        ask_count(scene, target, "random", random_rays(scene_, query_count()), false);
        ask_contains(scene, target, "near", near);
        ask_contains(scene, target, "in box", in_box);
    }

private:
    void ask_closest(const morphray::Scene& scene, const SimdTarget& target, const char* where,
                     const std::vector<vec3>& points) {
        const std::vector<morphray::Vec3> asked = to_user(points);
        std::vector<morphray::ClosestPoint> ours(points.size());
        std::vector<NearestPoint> theirs(points.size());
        const auto compare = [&](Row& row) {
            DistanceDifference difference;
            for (std::size_t i = 0; i < points.size(); ++i)
                difference.add(ours[i].distance, theirs[i].distance);
            row.mismatches.t = difference.count;
            row.largest_difference = difference.largest;
        };
        std::vector<QuestionPeer> peers;
        for (EmbreeQuestions& embree : embree_) {
            peers.push_back({"Embree PointQuery " + embree.name(), embree.group(),
                             [&] { embree.find_closest(points, theirs); }, compare});
        }
        if (cgal_) {
            peers.push_back(
                {cgal_->name(), "cgal", [&] { cgal_->find_closest(points, theirs); }, compare});
        }
        report(target,
               {fmt::format("closest_points, {}", where),
                {},
                [&] { scene.closest_points(asked, ours); }},
               peers, points.size(), [&] {
                   return std::count_if(ours.begin(), ours.end(),
                                        [](const auto& closest) { return bool{closest}; });
               });
    }

    void ask_count(const morphray::Scene& scene, const SimdTarget& target, const char* which,
                   const std::vector<Ray>& rays, bool coherent) {
        const std::vector<morphray::Ray> asked = to_user(rays);
        std::vector<std::uint64_t> ours(rays.size());
        const auto known = coherent ? morphray::Coherence::image(scene_.params.width)
                                    : morphray::Coherence::sort();
        const auto differs = [](std::uint64_t a, std::uint64_t b) { return a != b; };
        report(target,
               {fmt::format("count, {}", which),
                {},
                [&] { scene.count(asked, ours, morphray::Crossing::each, known); }},
               counting_peers(rays, coherent, ours, differs), rays.size(), [&] {
                   return std::count_if(ours.begin(), ours.end(),
                                        [](auto hits) { return hits != 0; });
               });
    }

    /// By the rule that Embree's hits of a half-line can follow, too.
    void ask_contains(const morphray::Scene& scene, const SimdTarget& target, const char* where,
                      const std::vector<vec3>& points) {
        const std::vector<morphray::Vec3> asked = to_user(points);
        const std::vector<Ray> rays = rays_up(points);
        std::vector<std::uint8_t> ours(points.size());
        const auto differs = [](std::uint8_t inside, std::uint64_t hits) {
            return inside != hits % 2;
        };
        report(target,
               {fmt::format("contains, {}", where),
                {},
                [&] { scene.contains(asked, ours, morphray::FillRule::odd); }},
               counting_peers(rays, false, ours, differs), points.size(),
               [&] { return std::count(ours.begin(), ours.end(), std::uint8_t{1}); });
    }

    template <class Answer, class Differs>
    std::vector<QuestionPeer> counting_peers(const std::vector<Ray>& rays, bool coherent,
                                             const std::vector<Answer>& ours, Differs differs) {
        std::vector<QuestionPeer> peers;
        for (EmbreeQuestions& embree : embree_) {
            peers.push_back({"Embree Intersect1 with a filter " + embree.name(), embree.group(),
                             [&, coherent] { embree.count(rays, coherent); },
                             [&, differs](Row& row) {
                                 for (std::size_t i = 0; i < ours.size(); ++i)
                                     row.mismatches.hit += differs(ours[i], embree.counts()[i]);
                             }});
        }
        return peers;
    }

    /// Times ours and the peers in turn, and reports ours against the fastest of each group.
    /// count_answers() counts the queries that found something.
    template <class CountAnswers>
    void report(const SimdTarget& target, const Method& ours,
                const std::vector<QuestionPeer>& peers, std::size_t queries,
                CountAnswers count_answers) {
        std::vector<Method> methods = {ours};
        for (const QuestionPeer& peer : peers)
            methods.push_back({peer.name, {}, [&] { arena_.execute([&] { peer.run(); }); }});
        const std::vector<Samples> samples = time_interleaved(methods, rig_.repeat);
        const double hit_share = share_of(static_cast<std::size_t>(count_answers()), queries);
        for (const std::size_t peer : fastest_of_groups(peers, samples)) {
            Row row = row_of(rig_, scene_, "queries");
            row.rays = queries;
            row.hit_share = hit_share;
            row.tracer = ours.name;
            row.target = target.name;
            row.peer = peers[peer].name;
            set_times(row, times_of(samples[0]), times_of(samples[1 + peer]), Unit::kNsPerQuery,
                      queries);
            methods[1 + peer].run();
            peers[peer].compare(row);
            rig_.report(row);
        }
    }

    const Rig& rig_;
    const BenchScene& scene_;
    std::vector<morphray::Vec3> points_;
    EmbreeMesh mesh_;
    ThreadArena arena_;
    std::deque<EmbreeQuestions> embree_;
    std::unique_ptr<CgalTree> cgal_;
};

}  // namespace

void bench_queries(const Rig& rig, const BenchScene& scene) {
    Questions questions(rig, scene);
    for (const SimdTarget& target : rig.targets) questions.ask_all(target);
}

}  // namespace mray::bench

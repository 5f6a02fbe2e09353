#include "common/update/tree_updater.h"

#include <fmt/format.h>

#include <sys/resource.h>
#include <unistd.h>
#include <cassert>

namespace mray {
namespace {

// Costs that stand for clocks in deterministic decisions: about the milliseconds that one core of a
// server takes, with a tracer between the CPU's packets and a device.
constexpr double kRefitPerTriangle = 1.5e-6;
constexpr double kBuildPerTriangle = 100e-6;
constexpr double kRestructurePerTriangle = 10e-6;
constexpr double kTracePerRay = 20e-6;
constexpr double kTraceExponent = 0.3;
// A tree that was built where all vertices were in one place has an infinite ratio elsewhere.
constexpr double kMostCostRatio = 1e6;

/// The factor by which triangles have grown; 1 if that is not known.
double triangle_growth(double built, double now) { return built > 0 && now > 0 ? now / built : 1; }

}  // namespace

double tree_cost(std::span<const Node> nodes) {
    double node_area = 0;
    double leaf_area = 0;
    for (const Node& node : nodes) {
        for_each_child(node, [&](std::uint32_t slot, std::uint32_t child) {
            (is_leaf(child) ? leaf_area : node_area) += half_area(slot_box(node, slot));
        });
    }
    return half_area(node_box(nodes.front())) + node_area + kLeafCost * leaf_area;
}

TreeFit tree_fit(std::span<const Node> nodes, double triangle_area) {
    return {tree_cost(nodes), triangle_area, half_area(node_box(nodes.front()))};
}

TriangleSample::TriangleSample(const Topology& topology) {
    const std::size_t count = topology.triangles.size();
    const std::size_t step = std::max<std::size_t>(1, (count + kMost - 1) / kMost);
    for (std::size_t i = 0; i < count; i += step) triangles_.push_back(topology.triangles[i]);
}

double TriangleSample::area(std::span<const vec3> positions) const {
    double sum = 0;
    for (const uvec3& t : triangles_) {
        Box box;
        bool finite = true;
        for (const std::uint32_t vertex : {t.x, t.y, t.z}) {
            finite = finite && is_finite_vertex(positions[vertex]);
            box.extend(positions[vertex]);
        }
        if (finite) sum += half_area(box);
    }
    return sum;
}

double cost_ratio(const TreeFit& built, const TreeFit& now) {
    if (built.cost <= 0) return now.cost > 0 ? std::numeric_limits<double>::infinity() : 1;
    const double growth = now.cost / built.cost;
    if (built.triangle_area <= 0 || now.triangle_area <= 0) return growth;
    return growth * (built.triangle_area / now.triangle_area);
}

double overhead_visits(const TreeFit& built, const TreeFit& now) {
    if (now.root_area <= 0) return 0;
    const double growth = triangle_growth(built.triangle_area, now.triangle_area);
    return std::max(0.0, now.cost - growth * built.cost) / now.root_area;
}

const char* name_of(TreeStep step) {
    // In the order of TreeStep.
    constexpr const char* kNames[] = {"build", "keep", "refit", "restructure", "rebuild", "swap"};
    return kNames[static_cast<std::size_t>(step)];
}

TreeUpdater::TreeUpdater(const Topology& topology, const Pose& pose, Backend& tracer,
                         std::unique_ptr<UpdatePolicy> policy, const BuildConfig& build_config,
                         const UpdateConfig& config, const Bvh* tree)
    : topology_(topology),
      pose_(pose),
      tracer_(tracer),
      policy_(std::move(policy)),
      build_config_(build_config),
      deterministic_(config.deterministic),
      follows_ratio_(config.record_cost_ratio || policy_->needs_tree_cost()),
      sample_(topology) {
    Bvh bvh = tree == nullptr ? build() : *tree;
    note_built(bvh, pose_area());
    last_.reason = tree == nullptr ? "the first tree" : "a copy of another scene's tree";
    tracer_.set_scene(topology_, pose_, std::move(bvh));
    last_.times.upload_ms = tracer_.finish().update.upload_ms;
    // A copied tree tells nothing of the time of a build.
    const double estimate = kBuildPerTriangle * static_cast<double>(topology_.triangles.size());
    policy_->built(tree == nullptr ? cost_of_frame({}).rebuild : estimate);
}

TreeUpdater::~TreeUpdater() {
    if (!background_.valid()) return;
    // The thread of a parent's build is not in its child: the future would wait without end.
    if (process_ != ::getpid()) new std::future<Bvh>(std::move(background_));
    // The future waits in its own destructor.
    cancel_background_ = true;
}

const TreeUpdate& TreeUpdater::update() {
    assert(pose_.positions().size() == topology_.vertex_count);
    last_ = {};
    has_refitted_ = false;
    restructuring_.reset();
    if (background_frames_left_ > 0) --background_frames_left_;
    UpdateDecision decision = policy_->plan();
    if (decision.step != UpdateStep::kRebuild) {
        swap_is_due() ? swap() : refit(decision.reason);
        decision = review();
        if (decision.step == UpdateStep::kRestructure) {
            restructure(decision);
            decision = review();
        }
    }
    if (decision.step == UpdateStep::kRebuild) {
        rebuild(decision.reason);
    } else {
        const bool has_reason =
            last_.step == TreeStep::kSwapped || last_.step == TreeStep::kRestructured;
        if (!has_reason || decision.step != UpdateStep::kRefit) last_.reason = decision.reason;
        if (decision.step == UpdateStep::kRebuildInBackground && !background_.valid())
            start_background_build(decision.build_frames);
    }
    last_.build_pending = background_.valid();
    return last_;
}

bool TreeUpdater::swap_is_due() {
    if (!background_.valid()) return false;
    if (deterministic_) return background_frames_left_ == 0;
    if (background_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return false;
    if (!background_is_stale_) return true;
    background_.get();
    background_is_stale_ = false;
    return false;
}

void TreeUpdater::swap() {
    replace_tree(background_.get(), background_triangle_area_);
    last_.step = TreeStep::kSwapped;
    last_.reason = "for the tree that was built in the background";
    tracer_.refit(RefitExtent::kAll);
    has_refitted_ = true;
}

void TreeUpdater::refit(const std::string& reason) {
    const std::uint64_t leaves = tracer_.refit();
    // A tracer may leave its refit to the trace: finish() takes the times of that.
    has_refitted_ = true;
    last_.step = leaves > 0 ? TreeStep::kRefitted : TreeStep::kKept;
    last_.reason = reason;
}

UpdateDecision TreeUpdater::review() {
    double waited_ms = 0;
    if (follows_ratio_) {
        const Stopwatch watch;
        const UpdateTimes refit = finish_refit();
        waited_ms = std::max(0.0, watch.ms() - refit.refit_ms);
        last_.times += refit;
    }
    const Stopwatch watch;
    if (follows_ratio_) {
        triangle_area_ = pose_area();
        const TreeFit fit = tree_fit(tracer_.nodes(), triangle_area_);
        last_.cost_ratio = cost_ratio(built_fit_, fit);
        last_.overhead = overhead_visits(built_fit_, fit);
    }
    UpdateDecision decision = policy_->review({.overhead = last_.overhead,
                                               .build_pending = background_.valid(),
                                               .new_tree = last_.step == TreeStep::kSwapped,
                                               .restructured = restructuring_.has_value()});
    // A ratio that is found for the record only is not a cost of the policy.
    if (policy_->needs_tree_cost()) last_.times.decide_ms += waited_ms + watch.ms();
    return decision;
}

void TreeUpdater::restructure(const UpdateDecision& decision) {
    const Stopwatch watch;
    std::size_t parts = 0;
    UpdateTimes times;
    tracer_.edit_tree([&](Bvh& bvh) {
        const Stopwatch inner;
        const double growth = triangle_growth(built_fit_.triangle_area, triangle_area_);
        parts = mray::restructure(topology_, pose_.positions(), growth, decision.most_restructured,
                                  bvh, areas_);
        times.restructure_ms = inner.ms();
        return parts > 0;
    });
    last_.reason = decision.reason;
    if (parts > 0) {
        last_.step = TreeStep::kRestructured;
        last_.reason += fmt::format(", of {} parts", parts);
    }
    times.upload_ms = watch.ms() - times.restructure_ms;
    last_.times += times;
    restructuring_ = times;
}

void TreeUpdater::rebuild(const std::string& reason) {
    // A pending build has an older pose. Deterministic updates wait for it, others drop it later.
    if (deterministic_ && background_.valid()) background_.get();
    background_is_stale_ = background_.valid();
    last_.step = TreeStep::kRebuilt;
    last_.reason = reason;
    last_.cost_ratio = 1;
    last_.overhead = 0;
    Bvh bvh = build();
    last_.times += finish_refit();
    replace_tree(std::move(bvh), pose_area());
}

/// Builds a tree while frames are traced, after T. Ize, I. Wald, S. Parker. Asynchronous BVH
/// construction for ray tracing dynamic scenes on parallel multi-core architectures. EGPGV 2007.
void TreeUpdater::start_background_build(std::uint32_t build_frames) {
    process_ = ::getpid();
    background_ = std::async(std::launch::async, [this, pose = pose_] {
        // At normal priority a build slows down tracing; at 10 it starves.
        constexpr int kNiceness = 5;
        setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), kNiceness);
        return build_bvh(topology_, pose.positions(),
                         {.threads = 1, .watch = Watch(&cancel_background_)});
    });
    background_triangle_area_ = pose_area();
    background_frames_left_ = build_frames;
}

Bvh TreeUpdater::build() {
    const Stopwatch watch;
    Bvh bvh = build_bvh(topology_, pose_.positions(), build_config_);
    last_.times.rebuild_ms += watch.ms();
    return bvh;
}

double TreeUpdater::pose_area() const {
    return follows_ratio_ ? sample_.area(pose_.positions()) : 0;
}

void TreeUpdater::note_built(const Bvh& bvh, double triangle_area) {
    if (follows_ratio_) built_fit_ = tree_fit(bvh.nodes, triangle_area);
    if (policy_->needs_tree_cost()) areas_ = built_areas(bvh);
}

void TreeUpdater::replace_tree(Bvh bvh, double triangle_area) {
    note_built(bvh, triangle_area);
    tracer_.set_tree(std::move(bvh));
    last_.times.upload_ms += tracer_.finish().update.upload_ms;
}

/// Finishes a refit that would have waited for the trace. Returns its times, once.
UpdateTimes TreeUpdater::finish_refit() {
    if (!std::exchange(has_refitted_, false)) return {};
    const UpdateTimes& times = tracer_.finish().update;
    return {.upload_ms = times.upload_ms, .refit_ms = times.refit_ms};
}

FrameCost TreeUpdater::cost_of_frame(const TraceCost& trace) const {
    FrameCost cost;
    cost.overhead = last_.overhead;
    if (trace.other_rays > 0)
        cost.single_part = static_cast<double>(trace.other_rays) / static_cast<double>(trace.rays);
    const bool built = last_.step == TreeStep::kBuilt || last_.step == TreeStep::kRebuilt;
    cost.new_tree = built || last_.step == TreeStep::kSwapped;
    cost.build_pending = last_.build_pending;
    if (deterministic_) {
        const auto triangles = static_cast<double>(topology_.triangles.size());
        cost.refit = kRefitPerTriangle * triangles;
        cost.restructure = restructuring_ ? kRestructurePerTriangle * triangles : 0;
        cost.rebuild = built ? kBuildPerTriangle * triangles : 0;
        cost.trace =
            kTracePerRay * static_cast<double>(trace.rays) *
            std::pow(std::min(std::max(1.0, last_.cost_ratio), kMostCostRatio), kTraceExponent);
        return cost;
    }
    const UpdateTimes& times = last_.times;
    const double passed_on_ms = restructuring_ ? restructuring_->upload_ms : 0;
    cost.refit = times.refit_ms + times.decide_ms + (built ? 0 : times.upload_ms - passed_on_ms);
    cost.restructure = times.restructure_ms + (built ? 0 : passed_on_ms);
    cost.rebuild = built ? times.rebuild_ms + times.upload_ms : 0;
    cost.trace = trace.ms;
    return cost;
}

void TreeUpdater::frame_done(const TraceCost& trace) {
    finish();
    FrameCost cost = cost_of_frame(trace);
    // built() has reported it.
    if (last_.step == TreeStep::kBuilt) cost.rebuild = 0;
    policy_->frame_done(cost);
}

const TreeUpdate& TreeUpdater::finish() {
    last_.times += finish_refit();
    return last_;
}

}  // namespace mray

// The host's part in the answers of a device.
#include <atomic>
#include <limits>
#include <mutex>
#include <numeric>

#include "common/interop/tie_break_rule.h"
#include "cpu/cpu_backend.h"
#include "cpu/queries/tree_queries.h"

namespace mray::cpu {
namespace {

/// Calls to the device wait for each other. It answers queries that see all triangles; those of
/// rays that do not by hits of the device, so that the tree need not be read back.
class HostAnswers final : public Backend {
public:
    HostAnswers(std::unique_ptr<Backend> device, const SimdTarget& target)
        : Backend(device->info()), device_(std::move(device)), target_(target) {}

    void require_own_process() const override { device_->require_own_process(); }

    void set_scene(const Topology& topology, const Pose& pose, Bvh bvh) override {
        change()->set_scene(topology, pose, std::move(bvh));
    }
    void set_tree(Bvh bvh) override { change()->set_tree(std::move(bvh)); }
    std::uint64_t refit(RefitExtent extent) override { return change()->refit(extent); }
    void edit_tree(const TreeEdit& edit) override { change()->edit_tree(edit); }
    std::span<const Node> nodes() override { return call()->nodes(); }
    void read_tree(Bvh& bvh) override { call()->read_tree(bvh); }
    const Bvh& host_tree() override {
        if (const Bvh* const tree = tree_.load(std::memory_order_acquire)) return *tree;
        const Call device = call();
        return *(tree_ = &device->host_tree());
    }

    void trace_image(const ImageParams& params, Frame& frame) override {
        trace_watched([&](const Call& device) { device->trace_image(params, frame); });
    }
    bool trace_lit(const LitView& view, Frame& samples, std::span<std::uint32_t> pixels,
                   std::span<LinearColour> linear) override {
        const Call device = call();
        device->watch_images(image_watch());
        if (!device->trace_lit(view, samples, pixels, linear)) return false;
        times_ = device->finish();
        return true;
    }
    void trace_views(const ViewBatch& views) override {
        trace_watched([&](const Call& device) { device->trace_views(views); });
    }
    double trace(const RayBatch& batch) override { return call()->trace(batch); }
    const BackendTimes& finish() override {
        times_.update = call()->finish().update;
        return times_;
    }

    std::size_t prepare(bool for_host) override {
        if (!for_host) return info().call_size;
        host_tree();
        return 1;
    }
    void query(const QueryBatch& batch) override {
        std::visit([this](const auto& query) { answer(query); }, batch);
    }

private:
    /// Keeps other calls out while it exists.
    class Call {
    public:
        Call(std::mutex& mutex, Backend& device) : lock_(mutex), device_(device) {}
        Backend* operator->() const { return &device_; }

    private:
        std::scoped_lock<std::mutex> lock_;
        Backend& device_;
    };
    Call call() { return {mutex_, *device_}; }
    template <class Trace>
    void trace_watched(Trace trace) {
        const Call device = call();
        device->watch_images(image_watch());
        trace(device);
        times_ = device->finish();
    }
    Call change() {
        tree_ = nullptr;
        return call();
    }

    template <class Query>
    void answer(const Query& query) {
        const bool is_filtered = query.filter != nullptr;
        if (is_for_host<Query>(is_filtered)) {
            TreeQueries(host_tree(), target_)(query);
        } else if (!is_filtered) {
            call()->query(query);
        } else if constexpr (!is_for_host<Query>(true)) {
            answer_filtered(query);
        }
    }

    void answer_filtered(const CountQuery& query) {
        HitLists none;
        answer_filtered(ListQuery{query.rays, query.crossing, 0, none, query.watch, query.filter});
        std::ranges::copy(none.total, query.counts.begin());
    }

    void answer_filtered(const ListQuery& query) {
        constexpr std::uint32_t kAllHits = std::numeric_limits<std::uint32_t>::max();
        HitLists all;
        answer(ListQuery{query.rays, query.crossing, kAllHits, all, query.watch});
        HitLists& lists = query.lists;
        auto hit = all.hits.cbegin();
        for (std::size_t i = 0; i < query.rays.size(); ++i) {
            query.watch.throw_if_cancelled();
            const std::size_t first = lists.hits.size();
            std::uint64_t total = 0, flag = 0;
            for (const auto end = hit + all.listed[i]; hit != end; ++hit) {
                if (!query.filter->sees(i, hit->prim_id)) continue;
                if (total++ < query.most) lists.hits.push_back(*hit);
                if (may_touch_border(hit->u, hit->v)) flag = kTouchesBorder;
            }
            lists.listed.push_back(static_cast<std::uint32_t>(lists.hits.size() - first));
            lists.total.push_back(total | flag);
        }
    }

    /// Each round passes one more hit of each ray that it does not see.
    void answer_filtered(const NextQuery& query) {
        std::vector<std::size_t> left(query.rays.size());
        std::iota(left.begin(), left.end(), std::size_t{0});
        std::vector<Ray> rays(query.rays.begin(), query.rays.end());
        std::vector<HitCursor> after(query.after.begin(), query.after.end());
        std::vector<Hit> found(query.rays.size());
        while (!left.empty()) {
            const std::size_t count = left.size();
            const std::span hits = std::span(found).first(count);
            answer(NextQuery{std::span(rays).first(count), std::span(after).first(count),
                             query.crossing, hits, query.watch});
            std::size_t kept = 0;
            for (std::size_t i = 0; i < count; ++i) {
                const Hit& hit = hits[i];
                if (hit.prim_id == kNoPrim || query.filter->sees(left[i], hit.prim_id)) {
                    query.hits[left[i]] = hit;
                    continue;
                }
                left[kept] = left[i];
                rays[kept] = rays[i];
                after[kept++] = {hit.t, hit.prim_id};
            }
            left.resize(kept);
        }
    }

    std::unique_ptr<Backend> device_;
    SimdTarget target_;
    std::mutex mutex_;
    /// host_tree(), or null if it has not been read since the last change.
    std::atomic<const Bvh*> tree_ = nullptr;
    /// finish() returns them: the times of the last image, which calls of trace() leave alone.
    BackendTimes times_;
};

}  // namespace

std::unique_ptr<Backend> with_host_answers(std::unique_ptr<Backend> device,
                                           const SimdTarget& target) {
    return std::make_unique<HostAnswers>(std::move(device), target);
}

}  // namespace mray::cpu

// Threads::calling: no other thread takes part.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <set>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "tests/library/scenes.h"

namespace mray::test {
namespace {

using morphray::Coherence;
using morphray::Device;
using morphray::Scene;
using morphray::Threads;

/// Memory that notes which thread touches each of its pages first: no page may be touched, and the
/// handler of the fault lets this one be. One at a time.
class WatchedPages {
public:
    static constexpr std::size_t kPages = 64;

    WatchedPages() : page_(static_cast<std::size_t>(sysconf(_SC_PAGESIZE))) {
        void* const mapped =
            mmap(nullptr, kPages * page_, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
        EXPECT_NE(mapped, MAP_FAILED);
        data_ = static_cast<char*>(mapped);
        watched = this;
        struct sigaction action = {};
        action.sa_sigaction = on_fault;
        action.sa_flags = SA_SIGINFO;
        sigaction(SIGSEGV, &action, &before_);
    }
    ~WatchedPages() {
        sigaction(SIGSEGV, &before_, nullptr);
        munmap(data_, kPages * page_);
    }
    WatchedPages(const WatchedPages&) = delete;

    template <class Item>
    std::span<Item> items(std::size_t count) {
        EXPECT_LE(count * sizeof(Item), kPages * page_);
        return {reinterpret_cast<Item*>(data_), count};
    }
    /// Forgets what was noted.
    void protect() {
        threads_ = {};
        mprotect(data_, kPages * page_, PROT_NONE);
    }
    std::set<pid_t> threads() const {
        std::set<pid_t> found(threads_.begin(), threads_.end());
        found.erase(0);
        return found;
    }

private:
    static void on_fault(int, siginfo_t* fault, void*) {
        const std::ptrdiff_t offset = static_cast<char*>(fault->si_addr) - watched->data_;
        const std::size_t page = static_cast<std::size_t>(offset) / watched->page_;
        if (offset < 0 || page >= kPages) {
            // Not ours: the access is repeated, and ends the program.
            sigaction(SIGSEGV, &watched->before_, nullptr);
            return;
        }
        watched->threads_[page] = gettid();
        mprotect(watched->data_ + page * watched->page_, watched->page_, PROT_READ | PROT_WRITE);
    }

    static inline WatchedPages* watched = nullptr;
    std::size_t page_;
    char* data_ = nullptr;
    std::array<pid_t, kPages> threads_ = {};
    struct sigaction before_;
};

/// Rays of an image row by row, and a part of one more row.
std::vector<morphray::Ray> image_rays(int width, int height) {
    std::vector<morphray::Ray> rays;
    for (int i = 0; i < width * height + 9; ++i) {
        const float x = static_cast<float>(i % width) / 80 - 0.9f;
        const float y = static_cast<float>(i / width) / 80 - 0.4f;
        rays.push_back({.org = {0.3f, 0.2f, 3}, .dir = {x, y, -1}});
    }
    return rays;
}

TEST(CallingThread, TracesAllRaysOfAnImage) {
    const UserMesh mesh(torus(40, 20));
    const Scene scene = Scene::build(mesh.view(), Device::cpu({.threads = 4}));
    // Some columns and rows are beside the tiles.
    for (const int width : {100, 101, 103, 107}) {
        const std::vector<morphray::Ray> rays = image_rays(width, 83);
        const auto coherence = Coherence::image(static_cast<std::size_t>(width));
        std::vector<morphray::Hit> expected;
        for (const morphray::Ray& ray : rays) expected.push_back(scene.intersect(ray));
        std::vector<morphray::Hit> hits(rays.size(), morphray::Hit{.t = -1});
        scene.intersect(rays, std::span(hits), Threads::calling, coherence);
        expect_same_hits(hits, expected, std::to_string(width));
        std::vector<std::uint8_t> occluded(rays.size(), 2);
        scene.occluded(rays, std::span(occluded), Threads::calling, coherence);
        for (std::size_t i = 0; i < rays.size(); ++i)
            ASSERT_EQ(occluded[i], expected[i] ? 1 : 0) << width << ", ray " << i;
    }
}

TEST(CallingThread, IsTheOnlyOneThatWritesAnswers) {
    const UserMesh mesh(torus(40, 20));
    const Scene scene = Scene::build(mesh.view(), Device::cpu({.threads = 4}));
    const std::pair<std::vector<morphray::Ray>, Coherence> batches[] = {
        {image_rays(100, 80), Coherence::image(100)},
        {world_rays(mesh, 8209, 31), Coherence::sort()}};
    WatchedPages pages;
    const std::set<pid_t> mine = {gettid()};
    for (const auto& [rays, coherence] : batches) {
        const auto hits = pages.items<morphray::Hit>(rays.size());
        const auto occluded = pages.items<std::uint8_t>(rays.size());
        // With all threads others write too, sooner or later: the pages would show it.
        bool are_others_seen = false;
        for (int round = 0; round < 1000 && !are_others_seen; ++round) {
            pages.protect();
            scene.intersect(rays, hits, coherence);
            are_others_seen = pages.threads() != mine;
        }
        EXPECT_TRUE(are_others_seen || std::thread::hardware_concurrency() < 2);
        for (int round = 0; round < 20; ++round) {
            pages.protect();
            scene.intersect(rays, hits, Threads::calling, coherence);
            EXPECT_EQ(pages.threads(), mine);
            pages.protect();
            scene.occluded(rays, occluded, Threads::calling, coherence);
            EXPECT_EQ(pages.threads(), mine);
        }
    }
}

}  // namespace
}  // namespace mray::test

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
#include <thread>
#include <vector>

#include "tests/library/scenes.h"

namespace mray::test {
namespace {

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

TEST(CallingThread, IsTheOnlyOneThatWritesAnswers) {
    const UserMesh mesh(torus(40, 20));
    const Scene scene = Scene::build(mesh.view(), Device::cpu({.threads = 4}));
    std::vector<morphray::Ray> image;
    for (int i = 0; i < 100 * 80 + 9; ++i) {
        const float x = static_cast<float>(i % 100) / 80 - 0.9f;
        const float y = static_cast<float>(i / 100) / 80 - 0.4f;
        image.push_back({.org = {0.3f, 0.2f, 3}, .dir = {x, y, -1}});
    }
    WatchedPages pages;
    const std::set<pid_t> mine = {gettid()};
    for (const auto& rays : {image, world_rays(mesh, 8009, 31)}) {
        const auto hits = pages.items<morphray::Hit>(rays.size());
        const auto occluded = pages.items<std::uint8_t>(rays.size());
        // With all threads others write too, sooner or later: the pages would show it.
        bool are_others_seen = false;
        for (int round = 0; round < 1000 && !are_others_seen; ++round) {
            pages.protect();
            scene.intersect(rays, hits);
            are_others_seen = pages.threads() != mine;
        }
        EXPECT_TRUE(are_others_seen || std::thread::hardware_concurrency() < 2);
        for (int round = 0; round < 20; ++round) {
            pages.protect();
            scene.intersect(rays, hits, Threads::calling);
            EXPECT_EQ(pages.threads(), mine);
            pages.protect();
            scene.occluded(rays, occluded, Threads::calling);
            EXPECT_EQ(pages.threads(), mine);
        }
    }
}

}  // namespace
}  // namespace mray::test

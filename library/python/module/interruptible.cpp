#include "library/python/module/interruptible.h"

#include <chrono>
#include <future>

namespace morphray::python {
namespace {

constexpr std::chrono::milliseconds kBetweenLooks{50};

bool is_main_thread() {
    const py::object main = py::module_::import("threading").attr("main_thread")().attr("ident");
    return main.equal(py::int_(PyThread_get_thread_ident()));
}

}  // namespace

void run_interruptibly(std::atomic<bool>& cancel, const std::function<void()>& work) {
    if (!is_main_thread()) {
        const py::gil_scoped_release release;
        work();
        return;
    }
    std::future<void> done = std::async(std::launch::async, std::cref(work));
    const auto is_done = [&] {
        const py::gil_scoped_release release;
        return done.wait_for(kBetweenLooks) == std::future_status::ready;
    };
    while (!is_done()) {
        if (PyErr_CheckSignals() == 0) continue;
        const py::error_already_set raised;
        cancel = true;
        while (!is_done()) {
        }
        throw raised;
    }
    done.get();
}

}  // namespace morphray::python

// Calls that Ctrl-C ends, and morphray.Cancel.
#pragma once

#include <pybind11/pybind11.h>

#include <atomic>
#include <functional>
#include <vector>

namespace morphray::python {

namespace py = pybind11;

/// Runs `work`, which is told by `cancel` to end early. Called with the GIL, which it gives up
/// meanwhile. Python runs handlers of signals in its main thread alone: a call from there waits
/// while another thread works, and looks at signals every 50 ms. If a handler raises, as that of
/// SIGINT does, `cancel` becomes true, and the exception is thrown once `work` has ended.
void run_interruptibly(std::atomic<bool>& cancel, const std::function<void()>& work);

/// Ends the calls that it has been given to. The GIL, which all members need, guards it.
class Cancel {
public:
    void set() {
        is_set_ = true;
        for (std::atomic<bool>* const call : calls_) *call = true;
    }
    void clear() { is_set_ = false; }
    bool is_set() const { return is_set_; }

    /// While it lives, set() makes `cancel` true.
    class Use {
    public:
        Use(Cancel* owner, std::atomic<bool>& cancel) : owner_(owner), cancel_(cancel) {
            if (owner_ == nullptr) return;
            owner_->calls_.push_back(&cancel_);
            if (owner_->is_set_) cancel_ = true;
        }
        ~Use() {
            if (owner_ != nullptr) std::erase(owner_->calls_, &cancel_);
        }
        Use(const Use&) = delete;

    private:
        Cancel* owner_;
        std::atomic<bool>& cancel_;
    };

private:
    bool is_set_ = false;
    std::vector<std::atomic<bool>*> calls_;
};

}  // namespace morphray::python

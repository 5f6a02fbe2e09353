#include "common/base/write_all.h"

#include <signal.h>
#include <unistd.h>

#include <cerrno>
#include <ctime>

namespace mray {
namespace {

/// While it lives, a write past the file size limit or into a closed pipe fails with EFBIG or EPIPE
/// in this thread instead of ending the process. The kernel sends both signals to the thread that
/// writes, so the destructor discards those that became pending and then unblocks them.
class WriteSignalsHeldBack {
public:
    WriteSignalsHeldBack() {
        sigset_t pending;
        sigpending(&pending);
        sigemptyset(&ours_);
        for (const int signal : {SIGXFSZ, SIGPIPE}) {
            if (!sigismember(&pending, signal)) sigaddset(&ours_, signal);
        }
        pthread_sigmask(SIG_BLOCK, &ours_, &before_);
    }
    ~WriteSignalsHeldBack() {
        const int error = errno;
        const timespec at_once = {};
        while (sigtimedwait(&ours_, nullptr, &at_once) > 0) {
        }
        pthread_sigmask(SIG_SETMASK, &before_, nullptr);
        errno = error;
    }
    WriteSignalsHeldBack(const WriteSignalsHeldBack&) = delete;
    WriteSignalsHeldBack& operator=(const WriteSignalsHeldBack&) = delete;

private:
    sigset_t ours_;
    sigset_t before_;
};

}  // namespace

int write_all(int fd, std::span<const std::byte> bytes) {
    const WriteSignalsHeldBack guard;
    while (!bytes.empty()) {
        const ssize_t written = ::write(fd, bytes.data(), bytes.size());
        if (written < 0 && errno == EINTR) continue;
        if (written < 0) return errno;
        bytes = bytes.subspan(static_cast<std::size_t>(written));
    }
    return 0;
}

}  // namespace mray

#include "tests/faults/fault.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <cstring>

namespace mray::test {

constinit Faults faults;

namespace {

// Runs before the constructors of libraries that are not preloaded.
__attribute__((constructor)) void read_environment() {
    if (const char* const file = std::getenv("MORPHRAY_FAULT_COUNTS")) {
        const int fd = static_cast<int>(::syscall(SYS_openat, AT_FDCWD, file, O_RDWR | O_CLOEXEC));
        void* const place = fd < 0 ? MAP_FAILED
                                   : ::mmap(nullptr, sizeof(FaultCounts), PROT_READ | PROT_WRITE,
                                            MAP_SHARED, fd, 0);
        if (place != MAP_FAILED) faults.counts = static_cast<FaultCounts*>(place);
        if (fd >= 0) ::close(fd);
    }
    const char* const text = std::getenv("MORPHRAY_FAULT");
    const char* const colon = text == nullptr ? nullptr : std::strchr(text, ':');
    if (colon == nullptr) return;
    char* end = nullptr;
    faults.at = std::strtoull(colon + 1, &end, 10);
    faults.error = *end == ':' ? std::atoi(end + 1) : ENOMEM;
    for (int kind = 0; kind < kFaultKinds; ++kind) {
        const std::size_t length = std::strlen(kFaultNames[kind]);
        if (static_cast<std::size_t>(colon - text) == length &&
            std::strncmp(text, kFaultNames[kind], length) == 0)
            faults.kind = kind;
    }
}

}  // namespace

bool fails(FaultKind kind) {
    const std::uint64_t call = std::atomic_ref(faults.counts->calls[kind]).fetch_add(1);
    if (faults.kind != kind || call < faults.at) return false;
    if (call != faults.at && !faults.lasts) return false;
    errno = faults.error;
    return true;
}

}  // namespace mray::test

// Preloaded into the program: lets one call of the system fail, and counts the calls of all kinds
// (fault.h). With the error 0, `read`, `pread` and `write` read or write a single byte. Also
// changes files while they are read (FileChange).
#include <dlfcn.h>
#include <fcntl.h>
#include <pthread.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "tests/faults/fault.h"

extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);
}

namespace mray::test {
namespace {

template <class Function>
Function* next(const char* name) {
    return reinterpret_cast<Function*>(::dlsym(RTLD_NEXT, name));
}

/// Whether a descriptor is one of the program's files, not a standard stream.
bool is_file(int fd) { return fd > STDERR_FILENO; }

/// Changes a file of the folder `in` if it is time to.
void change_input(int fd) {
    char link[40];
    std::snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
    char path[4096] = "";
    struct stat status;
    if (::readlink(link, path, sizeof path - 1) < 0 || std::strstr(path, "/in/") == nullptr ||
        ::fstat(fd, &status) != 0 || !fails(FaultKind::kInput))
        return;
    if (faults.error == FileChange::kIsWritten) {
        const int other = ::openat(AT_FDCWD, link, O_WRONLY | O_CLOEXEC);
        static_cast<void>(::pwrite(other, "~", 1, status.st_size / 2));
        ::close(other);
    } else {
        const bool shrinks = faults.error == FileChange::kShrinks;
        static_cast<void>(::truncate(link, shrinks ? status.st_size / 2 : status.st_size + 1));
    }
}

}  // namespace
}  // namespace mray::test

using mray::test::change_input;
using mray::test::fails;
using mray::test::FaultKind;
using mray::test::faults;
using mray::test::is_file;
using mray::test::next;

extern "C" {

void* malloc(std::size_t size) {
    return fails(FaultKind::kAllocation) ? nullptr : __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
    return fails(FaultKind::kAllocation) ? nullptr : __libc_calloc(count, size);
}
void* realloc(void* old, std::size_t size) {
    return fails(FaultKind::kAllocation) ? nullptr : __libc_realloc(old, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
    return fails(FaultKind::kAllocation) ? nullptr : __libc_memalign(alignment, size);
}
void* memalign(std::size_t alignment, std::size_t size) { return aligned_alloc(alignment, size); }
int posix_memalign(void** out, std::size_t alignment, std::size_t size) {
    const int error = errno;
    void* const memory = aligned_alloc(alignment, size);
    if (memory == nullptr) {
        errno = error;
        return ENOMEM;
    }
    *out = memory;
    return 0;
}

int open(const char* path, int flags, ...) {
    std::va_list more;
    va_start(more, flags);
    const mode_t mode = va_arg(more, mode_t);
    va_end(more);
    if (fails(FaultKind::kOpen)) return -1;
    static auto* const real = next<int(const char*, int, ...)>("open");
    return real(path, flags, mode);
}

ssize_t read(int fd, void* bytes, std::size_t size) {
    static auto* const real = next<ssize_t(int, void*, std::size_t)>("read");
    change_input(fd);
    if (is_file(fd) && fails(FaultKind::kRead)) {
        return faults.error == 0 && size > 0 ? real(fd, bytes, 1) : -1;
    }
    return real(fd, bytes, size);
}

ssize_t pread(int fd, void* bytes, std::size_t size, off_t offset) {
    static auto* const real = next<ssize_t(int, void*, std::size_t, off_t)>("pread");
    change_input(fd);
    if (fails(FaultKind::kRead)) {
        return faults.error == 0 && size > 0 ? real(fd, bytes, 1, offset) : -1;
    }
    return real(fd, bytes, size, offset);
}

ssize_t write(int fd, const void* bytes, std::size_t size) {
    static auto* const real = next<ssize_t(int, const void*, std::size_t)>("write");
    if (is_file(fd) && fails(FaultKind::kWrite)) {
        return faults.error == 0 && size > 0 ? real(fd, bytes, 1) : -1;
    }
    return real(fd, bytes, size);
}

int fsync(int fd) {
    static auto* const real = next<int(int)>("fsync");
    return fails(FaultKind::kSync) ? -1 : real(fd);
}

int linkat(int from_folder, const char* from, int to_folder, const char* to, int flags) {
    static auto* const real = next<int(int, const char*, int, const char*, int)>("linkat");
    return fails(FaultKind::kLink) ? -1 : real(from_folder, from, to_folder, to, flags);
}

int rename(const char* from, const char* to) {
    static auto* const real = next<int(const char*, const char*)>("rename");
    return fails(FaultKind::kRename) ? -1 : real(from, to);
}

int pthread_create(pthread_t* thread, const pthread_attr_t* attributes, void* (*start)(void*),
                   void* argument) {
    static auto* const real =
        next<int(pthread_t*, const pthread_attr_t*, void* (*)(void*), void*)>("pthread_create");
    return fails(FaultKind::kThread) ? EAGAIN : real(thread, attributes, start, argument);
}

}  // extern "C"

#include "app/commands/profile/shown_rows.h"

#include <utility>

namespace mray::app {

ShownRows::ShownRows(std::string header, bool is_shown, const Messages& messages)
    : messages_(messages), header_(std::move(header)), is_shown_(is_shown) {}

void ShownRows::add(std::string_view rows) {
    if (!is_shown_ || failure_) return;
    try {
        messages_.print(header_ + std::string(rows));
        header_.clear();
    } catch (...) {
        failure_ = std::current_exception();
    }
}

void ShownRows::finish() const {
    if (failure_) std::rethrow_exception(failure_);
}

}  // namespace mray::app

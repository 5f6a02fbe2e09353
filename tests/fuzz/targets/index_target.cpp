// Index files of clips: each must be refused as bad input, or be written again with the same bytes.
#include <cstddef>
#include <span>
#include <vector>

#include "clips/index/clip_index.h"
#include "tests/fuzz/targets/outcome.h"
#include "tests/fuzz/targets/targets.h"
#include "tests/support/index_bytes.h"

namespace mray::fuzz {
namespace {

std::string decoding_failure(const std::vector<std::byte>& bytes, bool* is_refused) {
    // The caller puts the name of the file before the text of an error.
    return failure_of(
        "",
        [&] {
            return encode_index(decode_index(bytes)) == bytes ? std::string()
                                                              : "written again with other bytes";
        },
        is_refused);
}

}  // namespace

std::string index_failure(std::string_view bytes) {
    const auto raw = std::as_bytes(std::span(bytes));
    std::vector<std::byte> copy(raw.begin(), raw.end());
    bool is_refused = false;
    std::string failure = decoding_failure(copy, &is_refused);
    if (!failure.empty() || !is_refused || copy.size() < sizeof(std::uint64_t)) return failure;
    // Tries the reader behind the checksum, too.
    test::set_checksum(copy);
    return decoding_failure(copy, nullptr);
}

}  // namespace mray::fuzz

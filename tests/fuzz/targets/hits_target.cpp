// Files of hits.
#include <cstddef>
#include <string>

#include "app/base/library_calls.h"
#include "morphray/hits.hpp"
#include "tests/fuzz/targets/case_file.h"
#include "tests/fuzz/targets/outcome.h"
#include "tests/fuzz/targets/targets.h"

namespace mray::fuzz {

std::string hits_failure(std::string_view bytes) {
    static CaseFile file("case.hits");
    file.write(bytes);
    return failure_of(file.path(), [&]() -> std::string {
        const morphray::HitsFile hits =
            app::call_library([&] { return morphray::read_hits(file.path()); });
        const std::size_t pixels = std::size_t{hits.width} * hits.height;
        for (const morphray::HitsFile::ImageHits& image : hits.images) {
            if (image.hits.size() != pixels || image.occlusion.size() != pixels)
                return "an image of another size";
        }
        return 20 + hits.images.size() * pixels * 20 == bytes.size() ? ""
                                                                     : "not all hits of the file";
    });
}

}  // namespace mray::fuzz

#include "app/base/remedy_text.h"

namespace mray::app {

const char* remedy_text(Remedy remedy) {
    switch (remedy) {
        case Remedy::kLenient:
            return " or accept it with --lenient";
        case Remedy::kAllowEmpty:
            return " --allow-empty accepts it";
        case Remedy::kReplaceMissing:
            return ", or use --missing hold or --missing skip";
        case Remedy::kNone:
            break;
    }
    return "";
}

std::string message_of(const Error& error) {
    return std::string(error.what()) + remedy_text(error.remedy());
}

}  // namespace mray::app

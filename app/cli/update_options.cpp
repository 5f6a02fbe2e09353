#include "app/cli/update_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <vector>

#include "common/base/errors.h"
#include "common/text/nearest_name.h"
#include "common/text/number_text.h"
#include "common/text/text_parts.h"

namespace mray::app {

std::string update_forms() {
    std::string forms;
    for (const UpdatePolicyInfo& info : update_policies()) {
        if (!forms.empty()) forms += '|';
        forms += info.form;
    }
    return forms;
}

std::string parse_update(const std::string& option, const std::string& text) {
    try {
        make_update_policy(text);
        return text;
    } catch (const Error& error) {
        std::vector<std::string> names;
        for (const UpdatePolicyInfo& info : update_policies()) names.emplace_back(info.form);
        throw Error(error.kind(),
                    fmt::format("{}: {}{}", option, error.what(), suggestion(text, names)));
    }
}

std::vector<std::string> parse_updates(const std::string& option, const std::string& text) {
    std::vector<std::string> policies;
    for (const std::string_view part : split(text, ',')) {
        policies.push_back(parse_update(option, std::string(part)));
        if (std::count(policies.begin(), policies.end(), policies.back()) > 1) {
            throw Error(ErrorKind::kBadArgument,
                        fmt::format("{}: {} is given twice", option, policies.back()));
        }
    }
    return policies;
}

void parse_update_budget(const std::string& option, const std::string& text, UpdateConfig& config) {
    const bool in_ms = text.ends_with("ms");
    const bool in_percent = text.ends_with('%');
    const std::string number = text.substr(0, text.size() - (in_ms ? 2 : in_percent ? 1 : 0));
    const std::optional<double> value = parse_finite_double(number);
    if (!(in_ms || in_percent) || !value || *value <= 0) {
        throw Error(
            ErrorKind::kBadArgument,
            fmt::format("{}: '{}' is neither a part of a frame such as 50% nor a time such as "
                        "2ms",
                        option, text));
    }
    config.budget_ms = in_ms ? *value : 0;
    if (in_percent) config.budget = *value / 100;
}

}  // namespace mray::app

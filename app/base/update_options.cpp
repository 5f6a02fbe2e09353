#include "app/base/update_options.h"

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
    for (const PolicyForm& form : policy_forms()) {
        if (!forms.empty()) forms += '|';
        forms += form.form;
    }
    return forms;
}

PolicySpec parse_update(const std::string& option, const std::string& text) {
    try {
        return parse_policy(text);
    } catch (const Error& error) {
        std::vector<std::string> names;
        for (const PolicyForm& form : policy_forms()) names.emplace_back(form.form);
        throw Error(error.kind(),
                    fmt::format("{}: {}{}", option, error.what(), suggestion(text, names)));
    }
}

std::vector<PolicySpec> parse_updates(const std::string& option, const std::string& text) {
    std::vector<PolicySpec> policies;
    for (const std::string_view part : split(text, ',')) {
        policies.push_back(parse_update(option, std::string(part)));
        if (std::count(policies.begin(), policies.end(), policies.back()) > 1) {
            throw Error(ErrorKind::kBadArgument,
                        fmt::format("{}: {} is given twice", option, text_of(policies.back())));
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

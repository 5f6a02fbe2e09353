#include "app/commands/merge/opinions.h"

#include <algorithm>

namespace mray::app {

Verdict judge(std::span<const Opinion> opinions) {
    Verdict verdict;
    for (const Opinion& opinion : opinions) {
        const auto agreeing = static_cast<std::size_t>(std::ranges::count_if(
            opinions, [&](const Opinion& other) { return opinion.agrees_with(other); }));
        if (2 * agreeing <= opinions.size()) verdict.wrong.push_back(opinion);
    }
    verdict.is_decided = verdict.wrong.size() < opinions.size();
    return verdict;
}

void add_suspects(const Verdict& verdict, std::vector<Suspect>& suspects) {
    for (const Opinion& opinion : verdict.wrong) {
        auto found = std::ranges::find_if(suspects, [&](const Suspect& suspect) {
            return suspect.shard == opinion.shard && suspect.host == opinion.host;
        });
        if (found == suspects.end())
            found = suspects.insert(found, {opinion.shard, opinion.host, 0, 0});
        ++(verdict.is_decided ? found->outvoted : found->undecided);
    }
}

}  // namespace mray::app

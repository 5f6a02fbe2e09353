// Writes the boxes of the quarters of one level of nodes, and the boxes of these nodes to the slots of
// their parents. Empty slots hold inverted boxes, which are neutral in a union.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shaders/kernel.glsl"
#include "shaders/refit/refit.glsl"

READ1(NodeParents, node_parents, kBindNodeParents);
WORDS(QuarterWords, quarter_words, kBindQuarterWords);

void main() {
    uint node = refit_item();
    vec3 lower = vec3(kEmptyPlane);
    vec3 upper = vec3(-kEmptyPlane);
    if (is_within()) {
        float planes[6];
        for (uint p = 0u; p < 6u; ++p)
            planes[p] = WORD_AT(node_words, plane_word(node, p, refit_lane()));
        lower = vec3(planes[0], planes[2], planes[4]);
        upper = vec3(planes[1], planes[3], planes[5]);
    }
    unite_quarters(lower, upper);
    if (!is_within()) return;
    for (uint word = refit_lane(); word < kQuarterWords; word += kRefitLanes) {
        STORE_WORD(quarter_words, node * kQuarterWords + word,
                   quarter_planes[first_quarter_plane() + word]);
    }
    uint parent = AT1(node_parents, node);
    if (parent != kNoNodeParent && refit_lane() < 6u)
        store_plane(parent, refit_lane(), united_plane(refit_lane()));
}

// Steps of VecGeom's navigator over Embree against those of a loop over all volumes: prints
// "pass CHECK" or "fail CHECK" lines. Needs libvecgeom-dev of Debian 12.
#include <VecGeom/management/EmbreeManager.h>
#include <VecGeom/management/GeoManager.h>
#include <VecGeom/navigation/EmbreeNavigator.h>
#include <VecGeom/volumes/LogicalVolume.h>
#include <VecGeom/volumes/UnplacedBox.h>

#include <cstdio>
#include <random>

using vecgeom::Vector3D;

int main() {
    std::mt19937 random(1);
    const auto real = [&](double low, double high) {
        return std::uniform_real_distribution<double>(low, high)(random);
    };
    const vecgeom::UnplacedBox world_box(10, 10, 10);
    vecgeom::LogicalVolume world("world", &world_box);
    for (int i = 0; i < 300; ++i) {
        const auto* const box =
            new vecgeom::UnplacedBox(real(0.1, 0.5), real(0.1, 0.5), real(0.1, 0.5));
        const auto* const place = new vecgeom::Transformation3D(
            real(-9, 9), real(-9, 9), real(-9, 9), real(0, 360), real(0, 180), real(0, 360));
        world.PlaceDaughter("box", new vecgeom::LogicalVolume(box), place);
    }
    vecgeom::GeoManager::Instance().SetWorldAndClose(world.Place());
    vecgeom::EmbreeManager::Instance().InitStructure(&world);
    const auto& navigator =
        *static_cast<vecgeom::EmbreeNavigator<>*>(vecgeom::EmbreeNavigator<>::Instance());
    int hits = 0;
    int wrong = 0;
    constexpr int kRays = 20000;
    for (int ray = 0; ray < kRays; ++ray) {
        const Vector3D<double> from(real(-9.9, 9.9), real(-9.9, 9.9), real(-9.9, 9.9));
        Vector3D<double> to(real(-1, 1), real(-1, 1), real(-1, 1));
        to.Normalize();
        double expected = vecgeom::kInfLength;
        const vecgeom::VPlacedVolume* first = nullptr;
        for (const vecgeom::VPlacedVolume* const volume : world.GetDaughters()) {
            const double distance = volume->DistanceToIn(from, to, vecgeom::kInfLength);
            if (distance >= expected) continue;
            expected = distance;
            first = volume;
        }
        double step = vecgeom::kInfLength;
        const vecgeom::VPlacedVolume* found = nullptr;
        navigator.CheckDaughterIntersections(&world, from, to, nullptr, nullptr, step, found);
        hits += first != nullptr;
        wrong += found != first || step != expected;
    }
    std::printf("%s %d of %d steps reach a volume\n", hits > 1000 ? "pass" : "fail", hits, kRays);
    std::printf("%s %d steps differ from those of the loop\n", wrong == 0 ? "pass" : "fail", wrong);
    return 0;
}

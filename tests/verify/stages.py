"""The stages of ./verify. Each calls what a developer calls by hand (CONTRIBUTING.md)."""

from runner import Stage

# reader_targets: the names of the targets of ./fuzz that read bytes.
READER_TARGETS = "sed -n 's/^reader_target(\\([a-z0-9]*\\) .*/\\1/p' tests/fuzz/CMakeLists.txt"


def faults(name: str, what: str, minutes: float, tests: str, is_measured: bool = True,
           program: str = "faults_test") -> Stage:
    return Stage(name, what, minutes, f"""
build_release {program}
export MORPHRAY_EVERY_FAULT=1
"$build/bin/{program}" --gtest_brief=1 --gtest_filter='{tests}'
""", packages="build test", is_measured=is_measured)


STAGES = [
    Stage("proofs", "Gappa and exhaustive searches prove the bounds of the hit rule, with the constants of the code; "
          "each proof fails with a bound that is tighter", 3, """
build_release check_proof proof_small_floats proof_small_floats_wrong proof_grids proof_reciprocals proof_owners
ctest --test-dir "$build" --output-on-failure -j2 -R '^proof_'
""", packages="build test"),
    Stage("test", "every test of the release build", 18, "./test", packages="build chart view test farm"),
    Stage("valgrind", "errors of memory and uninitialised values in the program, built as users have it", 10,
          "cmake/valgrind/run", packages="build test valgrind"),
    Stage("packages", "Debian packages are made, and lintian finds no error in them", 20, "cmake/package/run",
          packages="build chart view package"),
    Stage("reproducible", "two builds of HEAD, in two folders, make Debian packages of the same bytes", 21, """
if [ -n "$(git status --porcelain)" ]; then
    say "it tests what is committed, and files of this checkout are not"
    exit 4
fi
cmake/reproducible/run
""", packages="build chart view package"),
    Stage("wheel", "a wheel is made, and its tests run where there is nothing but Python, numpy and pytest", 15,
          "cmake/wheel/run", packages="build wheel", needs="Debian's archive; namespaces of Linux"),
    Stage("fuzz", "images and answers of random cases, on all instruction sets, trees and widths of lavapipe, against "
          "brute force, and calls of the library against a model: 9 minutes, each time with other seeds", 18, """
seed=$(date +%s)
echo "seed $seed"
./fuzz one-picture --backend all --hours 0.05 --seed "$seed"
./fuzz questions --backend all --hours 0.05 --seed "$seed"
./fuzz calls --backend all --hours 0.05 --seed "$seed"
""", packages="build chart test"),
    Stage("readers", "every reader of bytes under libFuzzer with sanitizers, half a minute each, each time with other "
          "seeds", 13, f"""
for target in $({READER_TARGETS}); do
    echo "== $target"
    ./fuzz "$target" --hours 0.008
done
""", packages="build test clang"),
    faults("output-faults", "each call that opens, reads, writes, renames or synchronises a file or starts a thread "
           "fails once; disks fill up, and inputs change while they are read", 5,
           "All/Faults.*:All/ChangedInputs.*:All/FullDisk.*-*OfMemory*"),
    faults("device-faults", "each call of Vulkan fails once: device lost, no memory of host or device", 51,
           "All/VulkanFaults.*"),
    faults("memory-faults", "each allocation of the program fails once", 55, "All/Faults.OfMemory*"),
    faults("library-memory", "memory ends at each allocation of each call of the library, once or from then on", 4,
           "*", program="library_memory_test"),
    faults("signals", "1,000 signals at random moments leave no torn file", 9, "*SignalsAtAnyTime*"),
    faults("killed-workers", "200 farms whose workers are killed at random moments are repaired by the same commands",
           8, "KilledWorkers.*"),
    Stage("asan", "AddressSanitizer and UBSan over all tests, with SIMD and Vulkan", 60, "cmake/asan/run all",
          packages="build test clang", is_measured=False),
    Stage("tsan", "data races in the suites that use threads, with an instrumented oneTBB", 40, "cmake/tsan/run",
          packages="build test tsan", needs="Debian's archive of sources", is_measured=False),
    Stage("planted", "mistakes that each break a promise about threads are noticed by the test that is named for it, "
          "under ThreadSanitizer", 35, """
cmake/tsan/run use_count_test
cmake/tsan/planted
""", packages="build test tsan", needs="Debian's archive of sources", is_measured=False),
    Stage("aarch64", "the CPU part for 64-bit Arm under qemu: tests that need no device, and the images of all "
          "built-in scenes", 60, """
cmake/aarch64/run arithmetic_test refit_test scene_space_test camera_setup_test procedural_test bvh_builder_test \\
    update_test stability_test queries_test tracer_test watertightness_test packet_tracer_test \\
    pixel_shader_test single_ray_tracer_test library_test gltf_test ply_test input_test
""", packages="build aarch64", needs="Debian's archive for arm64", is_measured=False),
    Stage("wheel-aarch64", "the same as wheel for 64-bit Arm, under qemu", 40, "cmake/wheel/run aarch64",
          packages="build wheel aarch64", needs="Debian's archive for arm64", is_measured=False),
    Stage("debian13", "./run, ./test and the packages on a bare Debian 13, in a clean clone of HEAD", 36, """
if [ -n "$(git status --porcelain)" ]; then
    say "it tests what is committed, and files of this checkout are not"
    exit 4
fi
cmake/debian13/run ./run ./test cmake/package/run
""", packages="debian13", needs="root; Debian's archive"),
    Stage("ray-query", "a Vulkan driver's own rays are asked as their interface says, and judged in exact arithmetic",
          10, """
./fuzz driver --cases 1000 --seed "$(date +%s)"
build_release gpu_ray_query_test suspect_driver_test
for suite in gpu_ray_query_test suspect_driver_test; do "$build/bin/$suite" --gtest_brief=1; done
""", packages="build chart test", needs="a driver with VK_KHR_ray_query, such as Debian 13's lavapipe"),
    Stage("embree", "programs that use Embree run with morphray in its place: Embree's verifier and tutorials, and of "
          "Open3D, Blender and VecGeom those that are installed; 200,000 random sequences of Embree's calls equal a "
          "model", 25, """
targets=()
for version in 3 4; do
    [ ! -e "/usr/include/embree$version/rtcore.h" ] ||
        targets+=("morphray_embree$version" "embree${version}_test")
done
build_release "${targets[@]}"
for test in "$build"/bin/embree?_test; do
    MORPHRAY_DOOR_CASES=200000 MORPHRAY_DOOR_SEED=$(date +%s) "$test" --gtest_brief=1 --gtest_filter='DoorCalls.*'
done
embree/clients/run
""", packages="build test clients", is_measured=False),
    Stage("soak", "a million frames on the CPU, 20,000 on Vulkan and 10,000 trees of each kind: nothing grows, no bit "
          "changes", 12, """
tests/soak/run --frames 1000000 --backend cpu
tests/soak/run --frames 20000 --backend vulkan
build_release morphray_soak_builds
"$build/bin/morphray_soak_builds" --count 10000
""", packages="build test", is_measured=False),
    Stage("mutations", "small mistakes in the sources, one at a time, are noticed by a test", 240, "tests/mutation/run",
          packages="build test mutation", is_measured=False),
]

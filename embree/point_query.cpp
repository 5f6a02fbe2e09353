// rtcPointQuery.
#include "embree/device.h"
#include "embree/scene.h"
bool rtcPointQuery(RTCScene, struct RTCPointQuery*, struct RTCPointQueryContext*,
                   RTCPointQueryFunction, void*) {
    return false;
}
bool rtcPointQuery4(const int*, RTCScene, struct RTCPointQuery4*, struct RTCPointQueryContext*,
                    RTCPointQueryFunction, void**) {
    return false;
}
bool rtcPointQuery8(const int*, RTCScene, struct RTCPointQuery8*, struct RTCPointQueryContext*,
                    RTCPointQueryFunction, void**) {
    return false;
}
bool rtcPointQuery16(const int*, RTCScene, struct RTCPointQuery16*, struct RTCPointQueryContext*,
                     RTCPointQueryFunction, void**) {
    return false;
}

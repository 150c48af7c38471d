/**
 * @license
 * Copyright 2010-2026 Three.js Authors
 * SPDX-License-Identifier: MIT
 */const Is={ROTATE:0,DOLLY:1,PAN:2},Ps={ROTATE:0,PAN:1,DOLLY_PAN:2,DOLLY_ROTATE:3},g0=0,du=1,v0=2,$o=1,_0=2,_r=3,ns=0,an=1,Gn=2,Ns=0,Tr=1,pu=2,fu=3,mu=4,Vp=5,Rs=100,x0=101,b0=102,w0=103,Hp=104,y0=200,kl=201,S0=202,E0=203,Gp=204,Wp=205,M0=206,T0=207,A0=208,C0=209,R0=210,P0=211,L0=212,D0=213,I0=214,Bl=0,zl=1,Vl=2,Pr=3,Hl=4,Gl=5,Wl=6,Xl=7,Xp=0,N0=1,U0=2,ci=0,qp=1,$p=2,Yp=3,Kp=4,Zp=5,jp=6,Qp=7,Jp=300,Gs=301,Lr=302,Ga=303,Wa=304,ql=1e3,oi=1001,$l=1002,Se=1003,O0=1004,co=1005,tn=1006,Xa=1007,Ni=1008,yn=1009,tf=1010,ef=1011,Dr=1012,Xc=1013,$n=1014,Nn=1015,Yn=1016,qc=1017,$c=1018,Ws=1020,nf=35902,sf=35899,rf=1021,of=1022,Wn=1023,Bi=1026,Ui=1027,Yc=1028,Kc=1029,is=1030,Zc=1031,jc=1033,Yo=33776,Ko=33777,Zo=33778,jo=33779,Yl=35840,Kl=35841,Zl=35842,jl=35843,Ql=36196,Jl=37492,tc=37496,ec=37488,nc=37489,oa=37490,ic=37491,sc=37808,rc=37809,oc=37810,ac=37811,lc=37812,cc=37813,hc=37814,uc=37815,dc=37816,pc=37817,fc=37818,mc=37819,gc=37820,vc=37821,_c=36492,xc=36494,bc=36495,wc=36283,yc=36284,aa=36285,Sc=36286,F0=3200,gu=0,k0=1,Di="",wn="srgb",la="srgb-linear",ca="linear",re="srgb",qa=7680,B0=519,z0=512,V0=513,H0=514,af=515,G0=516,W0=517,lf=518,cf=519,X0=35044,hf=35048,zi="300 es",Un=2e3,ha=2001;function q0(n){for(let t=n.length-1;t>=0;--t)if(n[t]>=65535)return!0;return!1}function ua(n){return document.createElementNS("http://www.w3.org/1999/xhtml",n)}function $0(){const n=ua("canvas");return n.style.display="block",n}const vu={};function _u(...n){const t="THREE."+n.shift();console.log(t,...n)}function uf(n){const t=n[0];if(typeof t=="string"&&t.startsWith("TSL:")){const e=n[1];e&&e.isStackTrace?n[0]+=" "+e.getLocation():n[1]='Stack trace not available. Enable "THREE.Node.captureStackTrace" to capture stack traces.'}return n}function Dt(...n){n=uf(n);const t="THREE."+n.shift();{const e=n[0];e&&e.isStackTrace?console.warn(e.getError(t)):console.warn(t,...n)}}function Qt(...n){n=uf(n);const t="THREE."+n.shift();{const e=n[0];e&&e.isStackTrace?console.error(e.getError(t)):console.error(t,...n)}}function Qo(...n){const t=n.join(" ");t in vu||(vu[t]=!0,Dt(...n))}function Y0(n,t,e){return new Promise(function(i,s){function r(){switch(n.clientWaitSync(t,n.SYNC_FLUSH_COMMANDS_BIT,0)){case n.WAIT_FAILED:s();break;case n.TIMEOUT_EXPIRED:setTimeout(r,e);break;default:i()}}setTimeout(r,e)})}const K0={[Bl]:Bl,[Vl]:Wl,[Hl]:Hl,[Pr]:Gl,[zl]:zl,[Wl]:Vl,[Xl]:Xl,[Gl]:Pr};class Gi{addEventListener(t,e){this._listeners===void 0&&(this._listeners={});const i=this._listeners;i[t]===void 0&&(i[t]=[]),i[t].indexOf(e)===-1&&i[t].push(e)}hasEventListener(t,e){const i=this._listeners;return i===void 0?!1:i[t]!==void 0&&i[t].indexOf(e)!==-1}removeEventListener(t,e){const i=this._listeners;if(i===void 0)return;const s=i[t];if(s!==void 0){const r=s.indexOf(e);r!==-1&&s.splice(r,1)}}dispatchEvent(t){const e=this._listeners;if(e===void 0)return;const i=e[t.type];if(i!==void 0){t.target=this;const s=i.slice(0);for(let r=0,o=s.length;r<o;r++)s[r].call(this,t);t.target=null}}}const Ye=["00","01","02","03","04","05","06","07","08","09","0a","0b","0c","0d","0e","0f","10","11","12","13","14","15","16","17","18","19","1a","1b","1c","1d","1e","1f","20","21","22","23","24","25","26","27","28","29","2a","2b","2c","2d","2e","2f","30","31","32","33","34","35","36","37","38","39","3a","3b","3c","3d","3e","3f","40","41","42","43","44","45","46","47","48","49","4a","4b","4c","4d","4e","4f","50","51","52","53","54","55","56","57","58","59","5a","5b","5c","5d","5e","5f","60","61","62","63","64","65","66","67","68","69","6a","6b","6c","6d","6e","6f","70","71","72","73","74","75","76","77","78","79","7a","7b","7c","7d","7e","7f","80","81","82","83","84","85","86","87","88","89","8a","8b","8c","8d","8e","8f","90","91","92","93","94","95","96","97","98","99","9a","9b","9c","9d","9e","9f","a0","a1","a2","a3","a4","a5","a6","a7","a8","a9","aa","ab","ac","ad","ae","af","b0","b1","b2","b3","b4","b5","b6","b7","b8","b9","ba","bb","bc","bd","be","bf","c0","c1","c2","c3","c4","c5","c6","c7","c8","c9","ca","cb","cc","cd","ce","cf","d0","d1","d2","d3","d4","d5","d6","d7","d8","d9","da","db","dc","dd","de","df","e0","e1","e2","e3","e4","e5","e6","e7","e8","e9","ea","eb","ec","ed","ee","ef","f0","f1","f2","f3","f4","f5","f6","f7","f8","f9","fa","fb","fc","fd","fe","ff"];let xu=1234567;const Ar=Math.PI/180,Ir=180/Math.PI;function Ks(){const n=Math.random()*4294967295|0,t=Math.random()*4294967295|0,e=Math.random()*4294967295|0,i=Math.random()*4294967295|0;return(Ye[n&255]+Ye[n>>8&255]+Ye[n>>16&255]+Ye[n>>24&255]+"-"+Ye[t&255]+Ye[t>>8&255]+"-"+Ye[t>>16&15|64]+Ye[t>>24&255]+"-"+Ye[e&63|128]+Ye[e>>8&255]+"-"+Ye[e>>16&255]+Ye[e>>24&255]+Ye[i&255]+Ye[i>>8&255]+Ye[i>>16&255]+Ye[i>>24&255]).toLowerCase()}function Ht(n,t,e){return Math.max(t,Math.min(e,n))}function Qc(n,t){return(n%t+t)%t}function Z0(n,t,e,i,s){return i+(n-t)*(s-i)/(e-t)}function j0(n,t,e){return n!==t?(e-n)/(t-n):0}function Cr(n,t,e){return(1-e)*n+e*t}function Q0(n,t,e,i){return Cr(n,t,1-Math.exp(-e*i))}function J0(n,t=1){return t-Math.abs(Qc(n,t*2)-t)}function tv(n,t,e){return n<=t?0:n>=e?1:(n=(n-t)/(e-t),n*n*(3-2*n))}function ev(n,t,e){return n<=t?0:n>=e?1:(n=(n-t)/(e-t),n*n*n*(n*(n*6-15)+10))}function nv(n,t){return n+Math.floor(Math.random()*(t-n+1))}function iv(n,t){return n+Math.random()*(t-n)}function sv(n){return n*(.5-Math.random())}function rv(n){n!==void 0&&(xu=n);let t=xu+=1831565813;return t=Math.imul(t^t>>>15,t|1),t^=t+Math.imul(t^t>>>7,t|61),((t^t>>>14)>>>0)/4294967296}function ov(n){return n*Ar}function av(n){return n*Ir}function lv(n){return n>0&&Number.isInteger(n)&&2**Math.round(Math.log2(n))===n}function cv(n){return Math.pow(2,Math.ceil(Math.log(n)/Math.LN2))}function df(n){return Math.pow(2,Math.floor(Math.log(n)/Math.LN2))}function hv(n,t,e,i,s){const r=Math.cos,o=Math.sin,a=r(e/2),l=o(e/2),c=r((t+i)/2),h=o((t+i)/2),d=r((t-i)/2),u=o((t-i)/2),p=r((i-t)/2),g=o((i-t)/2);switch(s){case"XYX":n.set(a*h,l*d,l*u,a*c);break;case"YZY":n.set(l*u,a*h,l*d,a*c);break;case"ZXZ":n.set(l*d,l*u,a*h,a*c);break;case"XZX":n.set(a*h,l*g,l*p,a*c);break;case"YXY":n.set(l*p,a*h,l*g,a*c);break;case"ZYZ":n.set(l*g,l*p,a*h,a*c);break;default:Dt("MathUtils: .setQuaternionFromProperEuler() encountered an unknown order: "+s)}}function Jc(n){switch(n.constructor){case Uint32Array:return 4294967295;case Uint16Array:return 65535;case Uint8Array:case Uint8ClampedArray:return 255;case Int32Array:return 2147483647;case Int16Array:return 32767;case Int8Array:return 127;default:return}}function pf(n,t){if(t.constructor===Float32Array)return n;const e=Jc(t);if(e===void 0)throw new Error("THREE.MathUtils: Invalid component type.");return Math.max(n/e,-1)}function ff(n,t){if(t.constructor===Float32Array)return n;const e=Jc(t);if(e===void 0)throw new Error("THREE.MathUtils: Invalid component type.");return Math.round(n*e)}const pi={DEG2RAD:Ar,RAD2DEG:Ir,generateUUID:Ks,clamp:Ht,euclideanModulo:Qc,mapLinear:Z0,inverseLerp:j0,lerp:Cr,damp:Q0,pingpong:J0,smoothstep:tv,smootherstep:ev,randInt:nv,randFloat:iv,randFloatSpread:sv,seededRandom:rv,degToRad:ov,radToDeg:av,isPowerOfTwo:lv,ceilPowerOfTwo:cv,floorPowerOfTwo:df,setQuaternionFromProperEuler:hv,normalize:ff,denormalize:pf};class It{static{this.prototype.isVector2=!0}constructor(t=0,e=0){this.x=t,this.y=e}get width(){return this.x}set width(t){this.x=t}get height(){return this.y}set height(t){this.y=t}set(t,e){return this.x=t,this.y=e,this}setScalar(t){return this.x=t,this.y=t,this}setX(t){return this.x=t,this}setY(t){return this.y=t,this}setComponent(t,e){switch(t){case 0:this.x=e;break;case 1:this.y=e;break;default:throw new Error("THREE.Vector2: index is out of range: "+t)}return this}getComponent(t){switch(t){case 0:return this.x;case 1:return this.y;default:throw new Error("THREE.Vector2: index is out of range: "+t)}}clone(){return new this.constructor(this.x,this.y)}copy(t){return this.x=t.x,this.y=t.y,this}add(t){return this.x+=t.x,this.y+=t.y,this}addScalar(t){return this.x+=t,this.y+=t,this}addVectors(t,e){return this.x=t.x+e.x,this.y=t.y+e.y,this}addScaledVector(t,e){return this.x+=t.x*e,this.y+=t.y*e,this}sub(t){return this.x-=t.x,this.y-=t.y,this}subScalar(t){return this.x-=t,this.y-=t,this}subVectors(t,e){return this.x=t.x-e.x,this.y=t.y-e.y,this}multiply(t){return this.x*=t.x,this.y*=t.y,this}multiplyScalar(t){return this.x*=t,this.y*=t,this}divide(t){return this.x/=t.x,this.y/=t.y,this}divideScalar(t){return this.multiplyScalar(1/t)}applyMatrix3(t){const e=this.x,i=this.y,s=t.elements;return this.x=s[0]*e+s[3]*i+s[6],this.y=s[1]*e+s[4]*i+s[7],this}min(t){return this.x=Math.min(this.x,t.x),this.y=Math.min(this.y,t.y),this}max(t){return this.x=Math.max(this.x,t.x),this.y=Math.max(this.y,t.y),this}clamp(t,e){return this.x=Ht(this.x,t.x,e.x),this.y=Ht(this.y,t.y,e.y),this}clampScalar(t,e){return this.x=Ht(this.x,t,e),this.y=Ht(this.y,t,e),this}clampLength(t,e){const i=this.length();return this.divideScalar(i||1).multiplyScalar(Ht(i,t,e))}floor(){return this.x=Math.floor(this.x),this.y=Math.floor(this.y),this}ceil(){return this.x=Math.ceil(this.x),this.y=Math.ceil(this.y),this}round(){return this.x=Math.round(this.x),this.y=Math.round(this.y),this}roundToZero(){return this.x=Math.trunc(this.x),this.y=Math.trunc(this.y),this}negate(){return this.x=-this.x,this.y=-this.y,this}dot(t){return this.x*t.x+this.y*t.y}cross(t){return this.x*t.y-this.y*t.x}lengthSq(){return this.x*this.x+this.y*this.y}length(){return Math.sqrt(this.x*this.x+this.y*this.y)}manhattanLength(){return Math.abs(this.x)+Math.abs(this.y)}normalize(){return this.divideScalar(this.length()||1)}angle(){return Math.atan2(-this.y,-this.x)+Math.PI}angleTo(t){const e=Math.sqrt(this.lengthSq()*t.lengthSq());if(e===0)return Math.PI/2;const i=this.dot(t)/e;return Math.acos(Ht(i,-1,1))}distanceTo(t){return Math.sqrt(this.distanceToSquared(t))}distanceToSquared(t){const e=this.x-t.x,i=this.y-t.y;return e*e+i*i}manhattanDistanceTo(t){return Math.abs(this.x-t.x)+Math.abs(this.y-t.y)}setLength(t){return this.normalize().multiplyScalar(t)}lerp(t,e){return this.x+=(t.x-this.x)*e,this.y+=(t.y-this.y)*e,this}lerpVectors(t,e,i){return this.x=t.x+(e.x-t.x)*i,this.y=t.y+(e.y-t.y)*i,this}equals(t){return t.x===this.x&&t.y===this.y}fromArray(t,e=0){return this.x=t[e],this.y=t[e+1],this}toArray(t=[],e=0){return t[e]=this.x,t[e+1]=this.y,t}fromBufferAttribute(t,e){return this.x=t.getX(e),this.y=t.getY(e),this}rotateAround(t,e){const i=Math.cos(e),s=Math.sin(e),r=this.x-t.x,o=this.y-t.y;return this.x=r*i-o*s+t.x,this.y=r*s+o*i+t.y,this}random(){return this.x=Math.random(),this.y=Math.random(),this}*[Symbol.iterator](){yield this.x,yield this.y}}class ce{constructor(t=0,e=0,i=0,s=1){this.isQuaternion=!0,this._x=t,this._y=e,this._z=i,this._w=s}static slerpFlat(t,e,i,s,r,o,a){let l=i[s+0],c=i[s+1],h=i[s+2],d=i[s+3],u=r[o+0],p=r[o+1],g=r[o+2],x=r[o+3];if(d!==x||l!==u||c!==p||h!==g){let m=l*u+c*p+h*g+d*x;m<0&&(u=-u,p=-p,g=-g,x=-x,m=-m);let f=1-a;if(m<.9995){const _=Math.acos(m),M=Math.sin(_);f=Math.sin(f*_)/M,a=Math.sin(a*_)/M,l=l*f+u*a,c=c*f+p*a,h=h*f+g*a,d=d*f+x*a}else{l=l*f+u*a,c=c*f+p*a,h=h*f+g*a,d=d*f+x*a;const _=1/Math.sqrt(l*l+c*c+h*h+d*d);l*=_,c*=_,h*=_,d*=_}}t[e]=l,t[e+1]=c,t[e+2]=h,t[e+3]=d}static multiplyQuaternionsFlat(t,e,i,s,r,o){const a=i[s],l=i[s+1],c=i[s+2],h=i[s+3],d=r[o],u=r[o+1],p=r[o+2],g=r[o+3];return t[e]=a*g+h*d+l*p-c*u,t[e+1]=l*g+h*u+c*d-a*p,t[e+2]=c*g+h*p+a*u-l*d,t[e+3]=h*g-a*d-l*u-c*p,t}get x(){return this._x}set x(t){this._x=t,this._onChangeCallback()}get y(){return this._y}set y(t){this._y=t,this._onChangeCallback()}get z(){return this._z}set z(t){this._z=t,this._onChangeCallback()}get w(){return this._w}set w(t){this._w=t,this._onChangeCallback()}set(t,e,i,s){return this._x=t,this._y=e,this._z=i,this._w=s,this._onChangeCallback(),this}clone(){return new this.constructor(this._x,this._y,this._z,this._w)}copy(t){return this._x=t.x,this._y=t.y,this._z=t.z,this._w=t.w,this._onChangeCallback(),this}setFromEuler(t,e=!0){const i=t._x,s=t._y,r=t._z,o=t._order,a=Math.cos,l=Math.sin,c=a(i/2),h=a(s/2),d=a(r/2),u=l(i/2),p=l(s/2),g=l(r/2);switch(o){case"XYZ":this._x=u*h*d+c*p*g,this._y=c*p*d-u*h*g,this._z=c*h*g+u*p*d,this._w=c*h*d-u*p*g;break;case"YXZ":this._x=u*h*d+c*p*g,this._y=c*p*d-u*h*g,this._z=c*h*g-u*p*d,this._w=c*h*d+u*p*g;break;case"ZXY":this._x=u*h*d-c*p*g,this._y=c*p*d+u*h*g,this._z=c*h*g+u*p*d,this._w=c*h*d-u*p*g;break;case"ZYX":this._x=u*h*d-c*p*g,this._y=c*p*d+u*h*g,this._z=c*h*g-u*p*d,this._w=c*h*d+u*p*g;break;case"YZX":this._x=u*h*d+c*p*g,this._y=c*p*d+u*h*g,this._z=c*h*g-u*p*d,this._w=c*h*d-u*p*g;break;case"XZY":this._x=u*h*d-c*p*g,this._y=c*p*d-u*h*g,this._z=c*h*g+u*p*d,this._w=c*h*d+u*p*g;break;default:Dt("Quaternion: .setFromEuler() encountered an unknown order: "+o)}return e===!0&&this._onChangeCallback(),this}setFromAxisAngle(t,e){const i=e/2,s=Math.sin(i);return this._x=t.x*s,this._y=t.y*s,this._z=t.z*s,this._w=Math.cos(i),this._onChangeCallback(),this}setFromRotationMatrix(t){const e=t.elements,i=e[0],s=e[4],r=e[8],o=e[1],a=e[5],l=e[9],c=e[2],h=e[6],d=e[10],u=i+a+d;if(u>0){const p=.5/Math.sqrt(u+1);this._w=.25/p,this._x=(h-l)*p,this._y=(r-c)*p,this._z=(o-s)*p}else if(i>a&&i>d){const p=2*Math.sqrt(1+i-a-d);this._w=(h-l)/p,this._x=.25*p,this._y=(s+o)/p,this._z=(r+c)/p}else if(a>d){const p=2*Math.sqrt(1+a-i-d);this._w=(r-c)/p,this._x=(s+o)/p,this._y=.25*p,this._z=(l+h)/p}else{const p=2*Math.sqrt(1+d-i-a);this._w=(o-s)/p,this._x=(r+c)/p,this._y=(l+h)/p,this._z=.25*p}return this._onChangeCallback(),this}setFromUnitVectors(t,e){let i=t.dot(e)+1;return i<1e-8?(i=0,Math.abs(t.x)>Math.abs(t.z)?(this._x=-t.y,this._y=t.x,this._z=0,this._w=i):(this._x=0,this._y=-t.z,this._z=t.y,this._w=i)):(this._x=t.y*e.z-t.z*e.y,this._y=t.z*e.x-t.x*e.z,this._z=t.x*e.y-t.y*e.x,this._w=i),this.normalize()}angleTo(t){return 2*Math.acos(Math.abs(Ht(this.dot(t),-1,1)))}rotateTowards(t,e){const i=this.angleTo(t);if(i===0)return this;const s=Math.min(1,e/i);return this.slerp(t,s),this}identity(){return this.set(0,0,0,1)}invert(){return this.conjugate()}conjugate(){return this._x*=-1,this._y*=-1,this._z*=-1,this._onChangeCallback(),this}dot(t){return this._x*t._x+this._y*t._y+this._z*t._z+this._w*t._w}lengthSq(){return this._x*this._x+this._y*this._y+this._z*this._z+this._w*this._w}length(){return Math.sqrt(this._x*this._x+this._y*this._y+this._z*this._z+this._w*this._w)}normalize(){let t=this.length();return t===0?(this._x=0,this._y=0,this._z=0,this._w=1):(t=1/t,this._x=this._x*t,this._y=this._y*t,this._z=this._z*t,this._w=this._w*t),this._onChangeCallback(),this}multiply(t){return this.multiplyQuaternions(this,t)}premultiply(t){return this.multiplyQuaternions(t,this)}multiplyQuaternions(t,e){const i=t._x,s=t._y,r=t._z,o=t._w,a=e._x,l=e._y,c=e._z,h=e._w;return this._x=i*h+o*a+s*c-r*l,this._y=s*h+o*l+r*a-i*c,this._z=r*h+o*c+i*l-s*a,this._w=o*h-i*a-s*l-r*c,this._onChangeCallback(),this}slerp(t,e){let i=t._x,s=t._y,r=t._z,o=t._w,a=this.dot(t);a<0&&(i=-i,s=-s,r=-r,o=-o,a=-a);let l=1-e;if(a<.9995){const c=Math.acos(a),h=Math.sin(c);l=Math.sin(l*c)/h,e=Math.sin(e*c)/h,this._x=this._x*l+i*e,this._y=this._y*l+s*e,this._z=this._z*l+r*e,this._w=this._w*l+o*e,this._onChangeCallback()}else this._x=this._x*l+i*e,this._y=this._y*l+s*e,this._z=this._z*l+r*e,this._w=this._w*l+o*e,this.normalize();return this}slerpQuaternions(t,e,i){return this.copy(t).slerp(e,i)}random(){const t=2*Math.PI*Math.random(),e=2*Math.PI*Math.random(),i=Math.random(),s=Math.sqrt(1-i),r=Math.sqrt(i);return this.set(s*Math.sin(t),s*Math.cos(t),r*Math.sin(e),r*Math.cos(e))}equals(t){return t._x===this._x&&t._y===this._y&&t._z===this._z&&t._w===this._w}fromArray(t,e=0){return this._x=t[e],this._y=t[e+1],this._z=t[e+2],this._w=t[e+3],this._onChangeCallback(),this}toArray(t=[],e=0){return t[e]=this._x,t[e+1]=this._y,t[e+2]=this._z,t[e+3]=this._w,t}fromBufferAttribute(t,e){return this._x=t.getX(e),this._y=t.getY(e),this._z=t.getZ(e),this._w=t.getW(e),this._onChangeCallback(),this}toJSON(){return this.toArray()}_onChange(t){return this._onChangeCallback=t,this}_onChangeCallback(){}*[Symbol.iterator](){yield this._x,yield this._y,yield this._z,yield this._w}}class C{static{this.prototype.isVector3=!0}constructor(t=0,e=0,i=0){this.x=t,this.y=e,this.z=i}set(t,e,i){return i===void 0&&(i=this.z),this.x=t,this.y=e,this.z=i,this}setScalar(t){return this.x=t,this.y=t,this.z=t,this}setX(t){return this.x=t,this}setY(t){return this.y=t,this}setZ(t){return this.z=t,this}setComponent(t,e){switch(t){case 0:this.x=e;break;case 1:this.y=e;break;case 2:this.z=e;break;default:throw new Error("THREE.Vector3: index is out of range: "+t)}return this}getComponent(t){switch(t){case 0:return this.x;case 1:return this.y;case 2:return this.z;default:throw new Error("THREE.Vector3: index is out of range: "+t)}}clone(){return new this.constructor(this.x,this.y,this.z)}copy(t){return this.x=t.x,this.y=t.y,this.z=t.z,this}add(t){return this.x+=t.x,this.y+=t.y,this.z+=t.z,this}addScalar(t){return this.x+=t,this.y+=t,this.z+=t,this}addVectors(t,e){return this.x=t.x+e.x,this.y=t.y+e.y,this.z=t.z+e.z,this}addScaledVector(t,e){return this.x+=t.x*e,this.y+=t.y*e,this.z+=t.z*e,this}sub(t){return this.x-=t.x,this.y-=t.y,this.z-=t.z,this}subScalar(t){return this.x-=t,this.y-=t,this.z-=t,this}subVectors(t,e){return this.x=t.x-e.x,this.y=t.y-e.y,this.z=t.z-e.z,this}multiply(t){return this.x*=t.x,this.y*=t.y,this.z*=t.z,this}multiplyScalar(t){return this.x*=t,this.y*=t,this.z*=t,this}multiplyVectors(t,e){return this.x=t.x*e.x,this.y=t.y*e.y,this.z=t.z*e.z,this}applyEuler(t){return this.applyQuaternion(bu.setFromEuler(t))}applyAxisAngle(t,e){return this.applyQuaternion(bu.setFromAxisAngle(t,e))}applyMatrix3(t){const e=this.x,i=this.y,s=this.z,r=t.elements;return this.x=r[0]*e+r[3]*i+r[6]*s,this.y=r[1]*e+r[4]*i+r[7]*s,this.z=r[2]*e+r[5]*i+r[8]*s,this}applyNormalMatrix(t){return this.applyMatrix3(t).normalize()}applyMatrix4(t){const e=this.x,i=this.y,s=this.z,r=t.elements,o=1/(r[3]*e+r[7]*i+r[11]*s+r[15]);return this.x=(r[0]*e+r[4]*i+r[8]*s+r[12])*o,this.y=(r[1]*e+r[5]*i+r[9]*s+r[13])*o,this.z=(r[2]*e+r[6]*i+r[10]*s+r[14])*o,this}applyQuaternion(t){const e=this.x,i=this.y,s=this.z,r=t.x,o=t.y,a=t.z,l=t.w,c=2*(o*s-a*i),h=2*(a*e-r*s),d=2*(r*i-o*e);return this.x=e+l*c+o*d-a*h,this.y=i+l*h+a*c-r*d,this.z=s+l*d+r*h-o*c,this}project(t){return this.applyMatrix4(t.matrixWorldInverse).applyMatrix4(t.projectionMatrix)}unproject(t){return this.applyMatrix4(t.projectionMatrixInverse).applyMatrix4(t.matrixWorld)}transformDirection(t){const e=this.x,i=this.y,s=this.z,r=t.elements;return this.x=r[0]*e+r[4]*i+r[8]*s,this.y=r[1]*e+r[5]*i+r[9]*s,this.z=r[2]*e+r[6]*i+r[10]*s,this.normalize()}divide(t){return this.x/=t.x,this.y/=t.y,this.z/=t.z,this}divideScalar(t){return this.multiplyScalar(1/t)}min(t){return this.x=Math.min(this.x,t.x),this.y=Math.min(this.y,t.y),this.z=Math.min(this.z,t.z),this}max(t){return this.x=Math.max(this.x,t.x),this.y=Math.max(this.y,t.y),this.z=Math.max(this.z,t.z),this}clamp(t,e){return this.x=Ht(this.x,t.x,e.x),this.y=Ht(this.y,t.y,e.y),this.z=Ht(this.z,t.z,e.z),this}clampScalar(t,e){return this.x=Ht(this.x,t,e),this.y=Ht(this.y,t,e),this.z=Ht(this.z,t,e),this}clampLength(t,e){const i=this.length();return this.divideScalar(i||1).multiplyScalar(Ht(i,t,e))}floor(){return this.x=Math.floor(this.x),this.y=Math.floor(this.y),this.z=Math.floor(this.z),this}ceil(){return this.x=Math.ceil(this.x),this.y=Math.ceil(this.y),this.z=Math.ceil(this.z),this}round(){return this.x=Math.round(this.x),this.y=Math.round(this.y),this.z=Math.round(this.z),this}roundToZero(){return this.x=Math.trunc(this.x),this.y=Math.trunc(this.y),this.z=Math.trunc(this.z),this}negate(){return this.x=-this.x,this.y=-this.y,this.z=-this.z,this}dot(t){return this.x*t.x+this.y*t.y+this.z*t.z}lengthSq(){return this.x*this.x+this.y*this.y+this.z*this.z}length(){return Math.sqrt(this.x*this.x+this.y*this.y+this.z*this.z)}manhattanLength(){return Math.abs(this.x)+Math.abs(this.y)+Math.abs(this.z)}normalize(){return this.divideScalar(this.length()||1)}setLength(t){return this.normalize().multiplyScalar(t)}lerp(t,e){return this.x+=(t.x-this.x)*e,this.y+=(t.y-this.y)*e,this.z+=(t.z-this.z)*e,this}lerpVectors(t,e,i){return this.x=t.x+(e.x-t.x)*i,this.y=t.y+(e.y-t.y)*i,this.z=t.z+(e.z-t.z)*i,this}cross(t){return this.crossVectors(this,t)}crossVectors(t,e){const i=t.x,s=t.y,r=t.z,o=e.x,a=e.y,l=e.z;return this.x=s*l-r*a,this.y=r*o-i*l,this.z=i*a-s*o,this}projectOnVector(t){const e=t.lengthSq();if(e===0)return this.set(0,0,0);const i=t.dot(this)/e;return this.copy(t).multiplyScalar(i)}projectOnPlane(t){return $a.copy(this).projectOnVector(t),this.sub($a)}reflect(t){return this.sub($a.copy(t).multiplyScalar(2*this.dot(t)))}angleTo(t){const e=Math.sqrt(this.lengthSq()*t.lengthSq());if(e===0)return Math.PI/2;const i=this.dot(t)/e;return Math.acos(Ht(i,-1,1))}distanceTo(t){return Math.sqrt(this.distanceToSquared(t))}distanceToSquared(t){const e=this.x-t.x,i=this.y-t.y,s=this.z-t.z;return e*e+i*i+s*s}manhattanDistanceTo(t){return Math.abs(this.x-t.x)+Math.abs(this.y-t.y)+Math.abs(this.z-t.z)}setFromSpherical(t){return this.setFromSphericalCoords(t.radius,t.phi,t.theta)}setFromSphericalCoords(t,e,i){const s=Math.sin(e)*t;return this.x=s*Math.sin(i),this.y=Math.cos(e)*t,this.z=s*Math.cos(i),this}setFromCylindrical(t){return this.setFromCylindricalCoords(t.radius,t.theta,t.y)}setFromCylindricalCoords(t,e,i){return this.x=t*Math.sin(e),this.y=i,this.z=t*Math.cos(e),this}setFromMatrixPosition(t){const e=t.elements;return this.x=e[12],this.y=e[13],this.z=e[14],this}setFromMatrixScale(t){const e=this.setFromMatrixColumn(t,0).length(),i=this.setFromMatrixColumn(t,1).length(),s=this.setFromMatrixColumn(t,2).length();return this.x=e,this.y=i,this.z=s,this}setFromMatrixColumn(t,e){return this.fromArray(t.elements,e*4)}setFromMatrix3Column(t,e){return this.fromArray(t.elements,e*3)}setFromEuler(t){return this.x=t._x,this.y=t._y,this.z=t._z,this}setFromColor(t){return this.x=t.r,this.y=t.g,this.z=t.b,this}equals(t){return t.x===this.x&&t.y===this.y&&t.z===this.z}fromArray(t,e=0){return this.x=t[e],this.y=t[e+1],this.z=t[e+2],this}toArray(t=[],e=0){return t[e]=this.x,t[e+1]=this.y,t[e+2]=this.z,t}fromBufferAttribute(t,e){return this.x=t.getX(e),this.y=t.getY(e),this.z=t.getZ(e),this}random(){return this.x=Math.random(),this.y=Math.random(),this.z=Math.random(),this}randomDirection(){const t=Math.random()*Math.PI*2,e=Math.random()*2-1,i=Math.sqrt(1-e*e);return this.x=i*Math.cos(t),this.y=e,this.z=i*Math.sin(t),this}*[Symbol.iterator](){yield this.x,yield this.y,yield this.z}}const $a=new C,bu=new ce;class Lt{static{this.prototype.isMatrix3=!0}constructor(t,e,i,s,r,o,a,l,c){this.elements=[1,0,0,0,1,0,0,0,1],t!==void 0&&this.set(t,e,i,s,r,o,a,l,c)}set(t,e,i,s,r,o,a,l,c){const h=this.elements;return h[0]=t,h[1]=s,h[2]=a,h[3]=e,h[4]=r,h[5]=l,h[6]=i,h[7]=o,h[8]=c,this}identity(){return this.set(1,0,0,0,1,0,0,0,1),this}copy(t){const e=this.elements,i=t.elements;return e[0]=i[0],e[1]=i[1],e[2]=i[2],e[3]=i[3],e[4]=i[4],e[5]=i[5],e[6]=i[6],e[7]=i[7],e[8]=i[8],this}extractBasis(t,e,i){return t.setFromMatrix3Column(this,0),e.setFromMatrix3Column(this,1),i.setFromMatrix3Column(this,2),this}setFromMatrix4(t){const e=t.elements;return this.set(e[0],e[4],e[8],e[1],e[5],e[9],e[2],e[6],e[10]),this}multiply(t){return this.multiplyMatrices(this,t)}premultiply(t){return this.multiplyMatrices(t,this)}multiplyMatrices(t,e){const i=t.elements,s=e.elements,r=this.elements,o=i[0],a=i[3],l=i[6],c=i[1],h=i[4],d=i[7],u=i[2],p=i[5],g=i[8],x=s[0],m=s[3],f=s[6],_=s[1],M=s[4],b=s[7],E=s[2],T=s[5],v=s[8];return r[0]=o*x+a*_+l*E,r[3]=o*m+a*M+l*T,r[6]=o*f+a*b+l*v,r[1]=c*x+h*_+d*E,r[4]=c*m+h*M+d*T,r[7]=c*f+h*b+d*v,r[2]=u*x+p*_+g*E,r[5]=u*m+p*M+g*T,r[8]=u*f+p*b+g*v,this}multiplyScalar(t){const e=this.elements;return e[0]*=t,e[3]*=t,e[6]*=t,e[1]*=t,e[4]*=t,e[7]*=t,e[2]*=t,e[5]*=t,e[8]*=t,this}determinant(){const t=this.elements,e=t[0],i=t[1],s=t[2],r=t[3],o=t[4],a=t[5],l=t[6],c=t[7],h=t[8];return e*o*h-e*a*c-i*r*h+i*a*l+s*r*c-s*o*l}invert(){const t=this.elements,e=t[0],i=t[1],s=t[2],r=t[3],o=t[4],a=t[5],l=t[6],c=t[7],h=t[8],d=h*o-a*c,u=a*l-h*r,p=c*r-o*l,g=e*d+i*u+s*p;if(g===0)return this.set(0,0,0,0,0,0,0,0,0);const x=1/g;return t[0]=d*x,t[1]=(s*c-h*i)*x,t[2]=(a*i-s*o)*x,t[3]=u*x,t[4]=(h*e-s*l)*x,t[5]=(s*r-a*e)*x,t[6]=p*x,t[7]=(i*l-c*e)*x,t[8]=(o*e-i*r)*x,this}transpose(){let t;const e=this.elements;return t=e[1],e[1]=e[3],e[3]=t,t=e[2],e[2]=e[6],e[6]=t,t=e[5],e[5]=e[7],e[7]=t,this}getNormalMatrix(t){return this.setFromMatrix4(t).invert().transpose()}transposeIntoArray(t){const e=this.elements;return t[0]=e[0],t[1]=e[3],t[2]=e[6],t[3]=e[1],t[4]=e[4],t[5]=e[7],t[6]=e[2],t[7]=e[5],t[8]=e[8],this}setUvTransform(t,e,i,s,r,o,a){const l=Math.cos(r),c=Math.sin(r);return this.set(i*l,i*c,-i*(l*o+c*a)+o+t,-s*c,s*l,-s*(-c*o+l*a)+a+e,0,0,1),this}scale(t,e){return Qo("Matrix3: .scale() is deprecated. Use .makeScale() instead."),this.premultiply(Ya.makeScale(t,e)),this}rotate(t){return Qo("Matrix3: .rotate() is deprecated. Use .makeRotation() instead."),this.premultiply(Ya.makeRotation(-t)),this}translate(t,e){return Qo("Matrix3: .translate() is deprecated. Use .makeTranslation() instead."),this.premultiply(Ya.makeTranslation(t,e)),this}makeTranslation(t,e){return t.isVector2?this.set(1,0,t.x,0,1,t.y,0,0,1):this.set(1,0,t,0,1,e,0,0,1),this}makeRotation(t){const e=Math.cos(t),i=Math.sin(t);return this.set(e,-i,0,i,e,0,0,0,1),this}makeScale(t,e){return this.set(t,0,0,0,e,0,0,0,1),this}equals(t){const e=this.elements,i=t.elements;for(let s=0;s<9;s++)if(e[s]!==i[s])return!1;return!0}fromArray(t,e=0){for(let i=0;i<9;i++)this.elements[i]=t[i+e];return this}toArray(t=[],e=0){const i=this.elements;return t[e]=i[0],t[e+1]=i[1],t[e+2]=i[2],t[e+3]=i[3],t[e+4]=i[4],t[e+5]=i[5],t[e+6]=i[6],t[e+7]=i[7],t[e+8]=i[8],t}clone(){return new this.constructor().fromArray(this.elements)}}const Ya=new Lt,wu=new Lt().set(.4123908,.3575843,.1804808,.212639,.7151687,.0721923,.0193308,.1191948,.9505322),yu=new Lt().set(3.2409699,-1.5373832,-.4986108,-.9692436,1.8759675,.0415551,.0556301,-.203977,1.0569715);function uv(){const n={enabled:!0,workingColorSpace:la,spaces:{},convert:function(s,r,o){return this.enabled===!1||r===o||!r||!o||(this.spaces[r].transfer===re&&(s.r=hi(s.r),s.g=hi(s.g),s.b=hi(s.b)),this.spaces[r].primaries!==this.spaces[o].primaries&&(s.applyMatrix3(this.spaces[r].toXYZ),s.applyMatrix3(this.spaces[o].fromXYZ)),this.spaces[o].transfer===re&&(s.r=Us(s.r),s.g=Us(s.g),s.b=Us(s.b))),s},workingToColorSpace:function(s,r){return this.convert(s,this.workingColorSpace,r)},colorSpaceToWorking:function(s,r){return this.convert(s,r,this.workingColorSpace)},getPrimaries:function(s){return this.spaces[s].primaries},getTransfer:function(s){return s===Di?ca:this.spaces[s].transfer},getToneMappingMode:function(s){return this.spaces[s].outputColorSpaceConfig.toneMappingMode||"standard"},getLuminanceCoefficients:function(s,r=this.workingColorSpace){return s.fromArray(this.spaces[r].luminanceCoefficients)},define:function(s){Object.assign(this.spaces,s)},_getMatrix:function(s,r,o){return s.copy(this.spaces[o].fromXYZ).multiply(this.spaces[r].toXYZ)},_getDrawingBufferColorSpace:function(s){return this.spaces[s].outputColorSpaceConfig.drawingBufferColorSpace},_getUnpackColorSpace:function(s=this.workingColorSpace){return this.spaces[s].workingColorSpaceConfig.unpackColorSpace}},t=[.64,.33,.3,.6,.15,.06],e=[.2126,.7152,.0722],i=[.3127,.329];return n.define({[la]:{primaries:t,whitePoint:i,transfer:ca,toXYZ:wu,fromXYZ:yu,luminanceCoefficients:e,workingColorSpaceConfig:{unpackColorSpace:wn},outputColorSpaceConfig:{drawingBufferColorSpace:wn}},[wn]:{primaries:t,whitePoint:i,transfer:re,toXYZ:wu,fromXYZ:yu,luminanceCoefficients:e,outputColorSpaceConfig:{drawingBufferColorSpace:wn}}}),n}const qt=uv();function hi(n){return n<.04045?n*.0773993808:Math.pow(n*.9478672986+.0521327014,2.4)}function Us(n){return n<.0031308?n*12.92:1.055*Math.pow(n,.41666)-.055}let ds;class dv{static getDataURL(t,e="image/png"){if(/^data:/i.test(t.src)||typeof HTMLCanvasElement>"u")return t.src;let i;if(t instanceof HTMLCanvasElement)i=t;else{ds===void 0&&(ds=ua("canvas")),ds.width=t.width,ds.height=t.height;const s=ds.getContext("2d");t instanceof ImageData?s.putImageData(t,0,0):s.drawImage(t,0,0,t.width,t.height),i=ds}return i.toDataURL(e)}static sRGBToLinear(t){if(typeof HTMLImageElement<"u"&&t instanceof HTMLImageElement||typeof HTMLCanvasElement<"u"&&t instanceof HTMLCanvasElement||typeof ImageBitmap<"u"&&t instanceof ImageBitmap){const e=ua("canvas");e.width=t.width,e.height=t.height;const i=e.getContext("2d");i.drawImage(t,0,0,t.width,t.height);const s=i.getImageData(0,0,t.width,t.height),r=s.data;for(let o=0;o<r.length;o++)r[o]=hi(r[o]/255)*255;return i.putImageData(s,0,0),e}else if(t.data){const e=t.data.slice(0);for(let i=0;i<e.length;i++)e instanceof Uint8Array||e instanceof Uint8ClampedArray?e[i]=Math.floor(hi(e[i]/255)*255):e[i]=hi(e[i]);return{data:e,width:t.width,height:t.height}}else return Dt("ImageUtils.sRGBToLinear(): Unsupported image type. No color space conversion applied."),t}}let pv=0;class th{constructor(t=null){this.isTextureSource=!0,Object.defineProperty(this,"id",{value:pv++}),this.uuid=Ks(),this.data=t,this.dataReady=!0,this.version=0}getSize(t){const e=this.data;return typeof HTMLVideoElement<"u"&&e instanceof HTMLVideoElement?t.set(e.videoWidth,e.videoHeight,0):typeof VideoFrame<"u"&&e instanceof VideoFrame?t.set(e.displayWidth,e.displayHeight,0):e!==null?t.set(e.width||0,e.height||0,e.depth||0):t.set(0,0,0),t}set needsUpdate(t){t===!0&&this.version++}toJSON(t){const e=t===void 0||typeof t=="string";if(!e&&t.images[this.uuid]!==void 0)return t.images[this.uuid];const i={uuid:this.uuid,url:""},s=this.data;if(s!==null){let r;if(Array.isArray(s)){r=[];for(let o=0,a=s.length;o<a;o++)s[o].isDataTexture?r.push(Ka(s[o].image)):r.push(Ka(s[o]))}else r=Ka(s);i.url=r}return e||(t.images[this.uuid]=i),i}}function Ka(n){return typeof HTMLImageElement<"u"&&n instanceof HTMLImageElement||typeof HTMLCanvasElement<"u"&&n instanceof HTMLCanvasElement||typeof ImageBitmap<"u"&&n instanceof ImageBitmap?dv.getDataURL(n):n.data?{data:Array.from(n.data),width:n.width,height:n.height,type:n.data.constructor.name}:(Dt("Texture: Unable to serialize Texture."),{})}let fv=0;const Za=new C;class je extends Gi{constructor(t=je.DEFAULT_IMAGE,e=je.DEFAULT_MAPPING,i=oi,s=oi,r=tn,o=Ni,a=Wn,l=yn,c=je.DEFAULT_ANISOTROPY,h=Di){super(),this.isTexture=!0,Object.defineProperty(this,"id",{value:fv++}),this.uuid=Ks(),this.name="",this.source=new th(t),this.mipmaps=[],this.mapping=e,this.channel=0,this.wrapS=i,this.wrapT=s,this.magFilter=r,this.minFilter=o,this.anisotropy=c,this.format=a,this.internalFormat=null,this.type=l,this.offset=new It(0,0),this.repeat=new It(1,1),this.center=new It(0,0),this.rotation=0,this.matrixAutoUpdate=!0,this.matrix=new Lt,this.generateMipmaps=!0,this.mipmapsAutoUpdate=!0,this.premultiplyAlpha=!1,this.flipY=!0,this.unpackAlignment=4,this.colorSpace=h,this.userData={},this.updateRanges=[],this.version=0,this.onUpdate=null,this.renderTarget=null,this.isRenderTargetTexture=!1,this.isArrayTexture=!!(t&&t.depth&&t.depth>1),this.pmremVersion=0,this.isPMREMTexture=!1,this.normalized=!1}get width(){return this.source.getSize(Za).x}get height(){return this.source.getSize(Za).y}get depth(){return this.source.getSize(Za).z}get image(){return this.source.data}set image(t){this.source.data=t}updateMatrix(){this.matrix.setUvTransform(this.offset.x,this.offset.y,this.repeat.x,this.repeat.y,this.rotation,this.center.x,this.center.y)}addUpdateRange(t,e){this.updateRanges.push({start:t,count:e})}clearUpdateRanges(){this.updateRanges.length=0}clone(){return new this.constructor().copy(this)}copy(t){return this.name=t.name,this.source=t.source,this.mipmaps=t.mipmaps.slice(0),this.mapping=t.mapping,this.channel=t.channel,this.wrapS=t.wrapS,this.wrapT=t.wrapT,this.magFilter=t.magFilter,this.minFilter=t.minFilter,this.anisotropy=t.anisotropy,this.format=t.format,this.internalFormat=t.internalFormat,this.type=t.type,this.normalized=t.normalized,this.offset.copy(t.offset),this.repeat.copy(t.repeat),this.center.copy(t.center),this.rotation=t.rotation,this.matrixAutoUpdate=t.matrixAutoUpdate,this.matrix.copy(t.matrix),this.generateMipmaps=t.generateMipmaps,this.mipmapsAutoUpdate=t.mipmapsAutoUpdate,this.premultiplyAlpha=t.premultiplyAlpha,this.flipY=t.flipY,this.unpackAlignment=t.unpackAlignment,this.colorSpace=t.colorSpace,this.renderTarget=t.renderTarget,this.isRenderTargetTexture=t.isRenderTargetTexture,this.isPMREMTexture=t.isPMREMTexture,this.isArrayTexture=t.isArrayTexture,this.userData=JSON.parse(JSON.stringify(t.userData)),this.needsUpdate=!0,this}setValues(t){for(const e in t){const i=t[e];if(i===void 0){Dt(`Texture.setValues(): parameter '${e}' has value of undefined.`);continue}const s=this[e];if(s===void 0){Dt(`Texture.setValues(): property '${e}' does not exist.`);continue}s&&i&&s.isVector2&&i.isVector2||s&&i&&s.isVector3&&i.isVector3||s&&i&&s.isMatrix3&&i.isMatrix3?s.copy(i):this[e]=i}}toJSON(t){const e=t===void 0||typeof t=="string";if(!e&&t.textures[this.uuid]!==void 0)return t.textures[this.uuid];const i={metadata:{version:4.7,type:"Texture",generator:"Texture.toJSON"},uuid:this.uuid,name:this.name,image:this.source.toJSON(t).uuid,mapping:this.mapping,channel:this.channel,repeat:[this.repeat.x,this.repeat.y],offset:[this.offset.x,this.offset.y],center:[this.center.x,this.center.y],rotation:this.rotation,wrap:[this.wrapS,this.wrapT],format:this.format,internalFormat:this.internalFormat,type:this.type,normalized:this.normalized,colorSpace:this.colorSpace,minFilter:this.minFilter,magFilter:this.magFilter,anisotropy:this.anisotropy,flipY:this.flipY,generateMipmaps:this.generateMipmaps,mipmapsAutoUpdate:this.mipmapsAutoUpdate,premultiplyAlpha:this.premultiplyAlpha,unpackAlignment:this.unpackAlignment};return Object.keys(this.userData).length>0&&(i.userData=this.userData),e||(t.textures[this.uuid]=i),i}dispose(){this.dispatchEvent({type:"dispose"})}transformUv(t){if(this.mapping!==Jp)return t;if(t.applyMatrix3(this.matrix),t.x<0||t.x>1)switch(this.wrapS){case ql:t.x=t.x-Math.floor(t.x);break;case oi:t.x=t.x<0?0:1;break;case $l:Math.abs(Math.floor(t.x)%2)===1?t.x=Math.ceil(t.x)-t.x:t.x=t.x-Math.floor(t.x);break}if(t.y<0||t.y>1)switch(this.wrapT){case ql:t.y=t.y-Math.floor(t.y);break;case oi:t.y=t.y<0?0:1;break;case $l:Math.abs(Math.floor(t.y)%2)===1?t.y=Math.ceil(t.y)-t.y:t.y=t.y-Math.floor(t.y);break}return this.flipY&&(t.y=1-t.y),t}set needsUpdate(t){t===!0&&(this.version++,this.source.needsUpdate=!0)}set needsPMREMUpdate(t){t===!0&&this.pmremVersion++}}je.DEFAULT_IMAGE=null;je.DEFAULT_MAPPING=Jp;je.DEFAULT_ANISOTROPY=1;class Ee{static{this.prototype.isVector4=!0}constructor(t=0,e=0,i=0,s=1){this.x=t,this.y=e,this.z=i,this.w=s}get width(){return this.z}set width(t){this.z=t}get height(){return this.w}set height(t){this.w=t}set(t,e,i,s){return this.x=t,this.y=e,this.z=i,this.w=s,this}setScalar(t){return this.x=t,this.y=t,this.z=t,this.w=t,this}setX(t){return this.x=t,this}setY(t){return this.y=t,this}setZ(t){return this.z=t,this}setW(t){return this.w=t,this}setComponent(t,e){switch(t){case 0:this.x=e;break;case 1:this.y=e;break;case 2:this.z=e;break;case 3:this.w=e;break;default:throw new Error("THREE.Vector4: index is out of range: "+t)}return this}getComponent(t){switch(t){case 0:return this.x;case 1:return this.y;case 2:return this.z;case 3:return this.w;default:throw new Error("THREE.Vector4: index is out of range: "+t)}}clone(){return new this.constructor(this.x,this.y,this.z,this.w)}copy(t){return this.x=t.x,this.y=t.y,this.z=t.z,this.w=t.w!==void 0?t.w:1,this}add(t){return this.x+=t.x,this.y+=t.y,this.z+=t.z,this.w+=t.w,this}addScalar(t){return this.x+=t,this.y+=t,this.z+=t,this.w+=t,this}addVectors(t,e){return this.x=t.x+e.x,this.y=t.y+e.y,this.z=t.z+e.z,this.w=t.w+e.w,this}addScaledVector(t,e){return this.x+=t.x*e,this.y+=t.y*e,this.z+=t.z*e,this.w+=t.w*e,this}sub(t){return this.x-=t.x,this.y-=t.y,this.z-=t.z,this.w-=t.w,this}subScalar(t){return this.x-=t,this.y-=t,this.z-=t,this.w-=t,this}subVectors(t,e){return this.x=t.x-e.x,this.y=t.y-e.y,this.z=t.z-e.z,this.w=t.w-e.w,this}multiply(t){return this.x*=t.x,this.y*=t.y,this.z*=t.z,this.w*=t.w,this}multiplyScalar(t){return this.x*=t,this.y*=t,this.z*=t,this.w*=t,this}applyMatrix4(t){const e=this.x,i=this.y,s=this.z,r=this.w,o=t.elements;return this.x=o[0]*e+o[4]*i+o[8]*s+o[12]*r,this.y=o[1]*e+o[5]*i+o[9]*s+o[13]*r,this.z=o[2]*e+o[6]*i+o[10]*s+o[14]*r,this.w=o[3]*e+o[7]*i+o[11]*s+o[15]*r,this}divide(t){return this.x/=t.x,this.y/=t.y,this.z/=t.z,this.w/=t.w,this}divideScalar(t){return this.multiplyScalar(1/t)}setAxisAngleFromQuaternion(t){this.w=2*Math.acos(t.w);const e=Math.sqrt(1-t.w*t.w);return e<1e-4?(this.x=1,this.y=0,this.z=0):(this.x=t.x/e,this.y=t.y/e,this.z=t.z/e),this}setAxisAngleFromRotationMatrix(t){let e,i,s,r;const l=t.elements,c=l[0],h=l[4],d=l[8],u=l[1],p=l[5],g=l[9],x=l[2],m=l[6],f=l[10];if(Math.abs(h-u)<.01&&Math.abs(d-x)<.01&&Math.abs(g-m)<.01){if(Math.abs(h+u)<.1&&Math.abs(d+x)<.1&&Math.abs(g+m)<.1&&Math.abs(c+p+f-3)<.1)return this.set(1,0,0,0),this;e=Math.PI;const M=(c+1)/2,b=(p+1)/2,E=(f+1)/2,T=(h+u)/4,v=(d+x)/4,S=(g+m)/4;return M>b&&M>E?M<.01?(i=0,s=.707106781,r=.707106781):(i=Math.sqrt(M),s=T/i,r=v/i):b>E?b<.01?(i=.707106781,s=0,r=.707106781):(s=Math.sqrt(b),i=T/s,r=S/s):E<.01?(i=.707106781,s=.707106781,r=0):(r=Math.sqrt(E),i=v/r,s=S/r),this.set(i,s,r,e),this}let _=Math.sqrt((m-g)*(m-g)+(d-x)*(d-x)+(u-h)*(u-h));return Math.abs(_)<.001&&(_=1),this.x=(m-g)/_,this.y=(d-x)/_,this.z=(u-h)/_,this.w=Math.acos((c+p+f-1)/2),this}setFromMatrixPosition(t){const e=t.elements;return this.x=e[12],this.y=e[13],this.z=e[14],this.w=e[15],this}min(t){return this.x=Math.min(this.x,t.x),this.y=Math.min(this.y,t.y),this.z=Math.min(this.z,t.z),this.w=Math.min(this.w,t.w),this}max(t){return this.x=Math.max(this.x,t.x),this.y=Math.max(this.y,t.y),this.z=Math.max(this.z,t.z),this.w=Math.max(this.w,t.w),this}clamp(t,e){return this.x=Ht(this.x,t.x,e.x),this.y=Ht(this.y,t.y,e.y),this.z=Ht(this.z,t.z,e.z),this.w=Ht(this.w,t.w,e.w),this}clampScalar(t,e){return this.x=Ht(this.x,t,e),this.y=Ht(this.y,t,e),this.z=Ht(this.z,t,e),this.w=Ht(this.w,t,e),this}clampLength(t,e){const i=this.length();return this.divideScalar(i||1).multiplyScalar(Ht(i,t,e))}floor(){return this.x=Math.floor(this.x),this.y=Math.floor(this.y),this.z=Math.floor(this.z),this.w=Math.floor(this.w),this}ceil(){return this.x=Math.ceil(this.x),this.y=Math.ceil(this.y),this.z=Math.ceil(this.z),this.w=Math.ceil(this.w),this}round(){return this.x=Math.round(this.x),this.y=Math.round(this.y),this.z=Math.round(this.z),this.w=Math.round(this.w),this}roundToZero(){return this.x=Math.trunc(this.x),this.y=Math.trunc(this.y),this.z=Math.trunc(this.z),this.w=Math.trunc(this.w),this}negate(){return this.x=-this.x,this.y=-this.y,this.z=-this.z,this.w=-this.w,this}dot(t){return this.x*t.x+this.y*t.y+this.z*t.z+this.w*t.w}lengthSq(){return this.x*this.x+this.y*this.y+this.z*this.z+this.w*this.w}length(){return Math.sqrt(this.x*this.x+this.y*this.y+this.z*this.z+this.w*this.w)}manhattanLength(){return Math.abs(this.x)+Math.abs(this.y)+Math.abs(this.z)+Math.abs(this.w)}normalize(){return this.divideScalar(this.length()||1)}setLength(t){return this.normalize().multiplyScalar(t)}lerp(t,e){return this.x+=(t.x-this.x)*e,this.y+=(t.y-this.y)*e,this.z+=(t.z-this.z)*e,this.w+=(t.w-this.w)*e,this}lerpVectors(t,e,i){return this.x=t.x+(e.x-t.x)*i,this.y=t.y+(e.y-t.y)*i,this.z=t.z+(e.z-t.z)*i,this.w=t.w+(e.w-t.w)*i,this}equals(t){return t.x===this.x&&t.y===this.y&&t.z===this.z&&t.w===this.w}fromArray(t,e=0){return this.x=t[e],this.y=t[e+1],this.z=t[e+2],this.w=t[e+3],this}toArray(t=[],e=0){return t[e]=this.x,t[e+1]=this.y,t[e+2]=this.z,t[e+3]=this.w,t}fromBufferAttribute(t,e){return this.x=t.getX(e),this.y=t.getY(e),this.z=t.getZ(e),this.w=t.getW(e),this}random(){return this.x=Math.random(),this.y=Math.random(),this.z=Math.random(),this.w=Math.random(),this}*[Symbol.iterator](){yield this.x,yield this.y,yield this.z,yield this.w}}class mv extends Gi{constructor(t=1,e=1,i={}){super(),i=Object.assign({generateMipmaps:!1,internalFormat:null,minFilter:tn,depthBuffer:!0,stencilBuffer:!1,resolveColorBuffer:!0,resolveDepthBuffer:!0,resolveStencilBuffer:!0,storeMultisampledColorBuffer:!0,storeMultisampledDepthBuffer:!0,storeMultisampledStencilBuffer:!0,depthTexture:null,samples:0,count:1,depth:1,multiview:!1,useArrayDepthTexture:!1},i),this.isRenderTarget=!0,this.width=t,this.height=e,this.depth=i.depth,this.scissor=new Ee(0,0,t,e),this.scissorTest=!1,this.viewport=new Ee(0,0,t,e),this.textures=[];const s=i.count;for(let r=0;r<s;r++)this.textures[r]=new je({width:t,height:e,depth:i.depth}),this.textures[r].isRenderTargetTexture=!0,this.textures[r].renderTarget=this;this._setTextureOptions(i),this.depthBuffer=i.depthBuffer,this.stencilBuffer=i.stencilBuffer,this.resolveColorBuffer=i.resolveColorBuffer,this.resolveDepthBuffer=i.resolveDepthBuffer,this.resolveStencilBuffer=i.resolveStencilBuffer,this.storeMultisampledColorBuffer=i.storeMultisampledColorBuffer,this.storeMultisampledDepthBuffer=i.storeMultisampledDepthBuffer,this.storeMultisampledStencilBuffer=i.storeMultisampledStencilBuffer,this._depthTexture=null,this.depthTexture=i.depthTexture,this.samples=i.samples,this.multiview=i.multiview,this.useArrayDepthTexture=i.useArrayDepthTexture}_setTextureOptions(t={}){const e={minFilter:tn,generateMipmaps:!1,flipY:!1,internalFormat:null};t.mapping!==void 0&&(e.mapping=t.mapping),t.wrapS!==void 0&&(e.wrapS=t.wrapS),t.wrapT!==void 0&&(e.wrapT=t.wrapT),t.wrapR!==void 0&&(e.wrapR=t.wrapR),t.magFilter!==void 0&&(e.magFilter=t.magFilter),t.minFilter!==void 0&&(e.minFilter=t.minFilter),t.format!==void 0&&(e.format=t.format),t.type!==void 0&&(e.type=t.type),t.anisotropy!==void 0&&(e.anisotropy=t.anisotropy),t.colorSpace!==void 0&&(e.colorSpace=t.colorSpace),t.flipY!==void 0&&(e.flipY=t.flipY),t.generateMipmaps!==void 0&&(e.generateMipmaps=t.generateMipmaps),t.mipmapsAutoUpdate!==void 0&&(e.mipmapsAutoUpdate=t.mipmapsAutoUpdate),t.internalFormat!==void 0&&(e.internalFormat=t.internalFormat);for(let i=0;i<this.textures.length;i++)this.textures[i].setValues(e)}get texture(){return this.textures[0]}set texture(t){this.textures[0]=t}set depthTexture(t){this._depthTexture!==null&&this._depthTexture.renderTarget===this&&(this._depthTexture.renderTarget=null),t!==null&&t.renderTarget===null&&(t.renderTarget=this),this._depthTexture=t}get depthTexture(){return this._depthTexture}setSize(t,e,i=1){if(this.width!==t||this.height!==e||this.depth!==i){this.width=t,this.height=e,this.depth=i;for(let s=0,r=this.textures.length;s<r;s++)this.textures[s].image.width=t,this.textures[s].image.height=e,this.textures[s].image.depth=i,this.textures[s].isData3DTexture!==!0&&(this.textures[s].isArrayTexture=this.textures[s].image.depth>1);this.dispose()}this.viewport.set(0,0,t,e),this.scissor.set(0,0,t,e)}clone(){return new this.constructor().copy(this)}copy(t){this.width=t.width,this.height=t.height,this.depth=t.depth,this.scissor.copy(t.scissor),this.scissorTest=t.scissorTest,this.viewport.copy(t.viewport),this.textures.length=0;for(let e=0,i=t.textures.length;e<i;e++){this.textures[e]=t.textures[e].clone(),this.textures[e].isRenderTargetTexture=!0,this.textures[e].renderTarget=this;const s=Object.assign({},t.textures[e].image);this.textures[e].source=new th(s)}if(this.depthBuffer=t.depthBuffer,this.stencilBuffer=t.stencilBuffer,this.resolveColorBuffer=t.resolveColorBuffer,this.resolveDepthBuffer=t.resolveDepthBuffer,this.resolveStencilBuffer=t.resolveStencilBuffer,this.storeMultisampledColorBuffer=t.storeMultisampledColorBuffer,this.storeMultisampledDepthBuffer=t.storeMultisampledDepthBuffer,this.storeMultisampledStencilBuffer=t.storeMultisampledStencilBuffer,t.depthTexture!==null)if(t.depthTexture.renderTarget===t){const e=t.depthTexture.clone();e.renderTarget=null,this.depthTexture=e}else this.depthTexture=t.depthTexture;else this.depthTexture=null;return this.samples=t.samples,this.multiview=t.multiview,this.useArrayDepthTexture=t.useArrayDepthTexture,this}dispose(){this.dispatchEvent({type:"dispose"})}}class En extends mv{constructor(t=1,e=1,i={}){super(t,e,i),this.isWebGLRenderTarget=!0}}class mf extends je{constructor(t=null,e=1,i=1,s=1){super(null),this.isDataArrayTexture=!0,this.image={data:t,width:e,height:i,depth:s},this.magFilter=Se,this.minFilter=Se,this.wrapR=oi,this.generateMipmaps=!1,this.flipY=!1,this.unpackAlignment=1,this.layerUpdates=new Set}copy(t){return super.copy(t),this.wrapR=t.wrapR,this}addLayerUpdate(t){this.layerUpdates.add(t)}clearLayerUpdates(){this.layerUpdates.clear()}}class gv extends je{constructor(t=null,e=1,i=1,s=1){super(null),this.isData3DTexture=!0,this.image={data:t,width:e,height:i,depth:s},this.magFilter=Se,this.minFilter=Se,this.wrapR=oi,this.generateMipmaps=!1,this.flipY=!1,this.unpackAlignment=1}copy(t){return super.copy(t),this.wrapR=t.wrapR,this}}class Yt{static{this.prototype.isMatrix4=!0}constructor(t,e,i,s,r,o,a,l,c,h,d,u,p,g,x,m){this.elements=[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1],t!==void 0&&this.set(t,e,i,s,r,o,a,l,c,h,d,u,p,g,x,m)}set(t,e,i,s,r,o,a,l,c,h,d,u,p,g,x,m){const f=this.elements;return f[0]=t,f[4]=e,f[8]=i,f[12]=s,f[1]=r,f[5]=o,f[9]=a,f[13]=l,f[2]=c,f[6]=h,f[10]=d,f[14]=u,f[3]=p,f[7]=g,f[11]=x,f[15]=m,this}identity(){return this.set(1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1),this}clone(){return new Yt().fromArray(this.elements)}copy(t){const e=this.elements,i=t.elements;return e[0]=i[0],e[1]=i[1],e[2]=i[2],e[3]=i[3],e[4]=i[4],e[5]=i[5],e[6]=i[6],e[7]=i[7],e[8]=i[8],e[9]=i[9],e[10]=i[10],e[11]=i[11],e[12]=i[12],e[13]=i[13],e[14]=i[14],e[15]=i[15],this}copyPosition(t){const e=this.elements,i=t.elements;return e[12]=i[12],e[13]=i[13],e[14]=i[14],this}setFromMatrix3(t){const e=t.elements;return this.set(e[0],e[3],e[6],0,e[1],e[4],e[7],0,e[2],e[5],e[8],0,0,0,0,1),this}extractBasis(t,e,i){return this.determinantAffine()===0?(t.set(1,0,0),e.set(0,1,0),i.set(0,0,1),this):(t.setFromMatrixColumn(this,0),e.setFromMatrixColumn(this,1),i.setFromMatrixColumn(this,2),this)}makeBasis(t,e,i){return this.set(t.x,e.x,i.x,0,t.y,e.y,i.y,0,t.z,e.z,i.z,0,0,0,0,1),this}extractRotation(t){if(t.determinantAffine()===0)return this.identity();const e=this.elements,i=t.elements,s=1/ps.setFromMatrixColumn(t,0).length(),r=1/ps.setFromMatrixColumn(t,1).length(),o=1/ps.setFromMatrixColumn(t,2).length();return e[0]=i[0]*s,e[1]=i[1]*s,e[2]=i[2]*s,e[3]=0,e[4]=i[4]*r,e[5]=i[5]*r,e[6]=i[6]*r,e[7]=0,e[8]=i[8]*o,e[9]=i[9]*o,e[10]=i[10]*o,e[11]=0,e[12]=0,e[13]=0,e[14]=0,e[15]=1,this}makeRotationFromEuler(t){const e=this.elements,i=t.x,s=t.y,r=t.z,o=Math.cos(i),a=Math.sin(i),l=Math.cos(s),c=Math.sin(s),h=Math.cos(r),d=Math.sin(r);if(t.order==="XYZ"){const u=o*h,p=o*d,g=a*h,x=a*d;e[0]=l*h,e[4]=-l*d,e[8]=c,e[1]=p+g*c,e[5]=u-x*c,e[9]=-a*l,e[2]=x-u*c,e[6]=g+p*c,e[10]=o*l}else if(t.order==="YXZ"){const u=l*h,p=l*d,g=c*h,x=c*d;e[0]=u+x*a,e[4]=g*a-p,e[8]=o*c,e[1]=o*d,e[5]=o*h,e[9]=-a,e[2]=p*a-g,e[6]=x+u*a,e[10]=o*l}else if(t.order==="ZXY"){const u=l*h,p=l*d,g=c*h,x=c*d;e[0]=u-x*a,e[4]=-o*d,e[8]=g+p*a,e[1]=p+g*a,e[5]=o*h,e[9]=x-u*a,e[2]=-o*c,e[6]=a,e[10]=o*l}else if(t.order==="ZYX"){const u=o*h,p=o*d,g=a*h,x=a*d;e[0]=l*h,e[4]=g*c-p,e[8]=u*c+x,e[1]=l*d,e[5]=x*c+u,e[9]=p*c-g,e[2]=-c,e[6]=a*l,e[10]=o*l}else if(t.order==="YZX"){const u=o*l,p=o*c,g=a*l,x=a*c;e[0]=l*h,e[4]=x-u*d,e[8]=g*d+p,e[1]=d,e[5]=o*h,e[9]=-a*h,e[2]=-c*h,e[6]=p*d+g,e[10]=u-x*d}else if(t.order==="XZY"){const u=o*l,p=o*c,g=a*l,x=a*c;e[0]=l*h,e[4]=-d,e[8]=c*h,e[1]=u*d+x,e[5]=o*h,e[9]=p*d-g,e[2]=g*d-p,e[6]=a*h,e[10]=x*d+u}return e[3]=0,e[7]=0,e[11]=0,e[12]=0,e[13]=0,e[14]=0,e[15]=1,this}makeRotationFromQuaternion(t){return this.compose(vv,t,_v)}lookAt(t,e,i){const s=this.elements;return cn.subVectors(t,e),cn.lengthSq()===0&&(cn.z=1),cn.normalize(),yi.crossVectors(i,cn),yi.lengthSq()===0&&(Math.abs(i.z)===1?cn.x+=1e-4:cn.z+=1e-4,cn.normalize(),yi.crossVectors(i,cn)),yi.normalize(),ho.crossVectors(cn,yi),s[0]=yi.x,s[4]=ho.x,s[8]=cn.x,s[1]=yi.y,s[5]=ho.y,s[9]=cn.y,s[2]=yi.z,s[6]=ho.z,s[10]=cn.z,this}multiply(t){return this.multiplyMatrices(this,t)}premultiply(t){return this.multiplyMatrices(t,this)}multiplyMatrices(t,e){const i=t.elements,s=e.elements,r=this.elements,o=i[0],a=i[4],l=i[8],c=i[12],h=i[1],d=i[5],u=i[9],p=i[13],g=i[2],x=i[6],m=i[10],f=i[14],_=i[3],M=i[7],b=i[11],E=i[15],T=s[0],v=s[4],S=s[8],N=s[12],P=s[1],U=s[5],D=s[9],F=s[13],L=s[2],z=s[6],$=s[10],k=s[14],tt=s[3],W=s[7],Q=s[11],et=s[15];return r[0]=o*T+a*P+l*L+c*tt,r[4]=o*v+a*U+l*z+c*W,r[8]=o*S+a*D+l*$+c*Q,r[12]=o*N+a*F+l*k+c*et,r[1]=h*T+d*P+u*L+p*tt,r[5]=h*v+d*U+u*z+p*W,r[9]=h*S+d*D+u*$+p*Q,r[13]=h*N+d*F+u*k+p*et,r[2]=g*T+x*P+m*L+f*tt,r[6]=g*v+x*U+m*z+f*W,r[10]=g*S+x*D+m*$+f*Q,r[14]=g*N+x*F+m*k+f*et,r[3]=_*T+M*P+b*L+E*tt,r[7]=_*v+M*U+b*z+E*W,r[11]=_*S+M*D+b*$+E*Q,r[15]=_*N+M*F+b*k+E*et,this}multiplyScalar(t){const e=this.elements;return e[0]*=t,e[4]*=t,e[8]*=t,e[12]*=t,e[1]*=t,e[5]*=t,e[9]*=t,e[13]*=t,e[2]*=t,e[6]*=t,e[10]*=t,e[14]*=t,e[3]*=t,e[7]*=t,e[11]*=t,e[15]*=t,this}determinant(){const t=this.elements,e=t[0],i=t[4],s=t[8],r=t[12],o=t[1],a=t[5],l=t[9],c=t[13],h=t[2],d=t[6],u=t[10],p=t[14],g=t[3],x=t[7],m=t[11],f=t[15],_=l*p-c*u,M=a*p-c*d,b=a*u-l*d,E=o*p-c*h,T=o*u-l*h,v=o*d-a*h;return e*(x*_-m*M+f*b)-i*(g*_-m*E+f*T)+s*(g*M-x*E+f*v)-r*(g*b-x*T+m*v)}determinantAffine(){const t=this.elements,e=t[0],i=t[4],s=t[8],r=t[1],o=t[5],a=t[9],l=t[2],c=t[6],h=t[10];return e*(o*h-a*c)-i*(r*h-a*l)+s*(r*c-o*l)}transpose(){const t=this.elements;let e;return e=t[1],t[1]=t[4],t[4]=e,e=t[2],t[2]=t[8],t[8]=e,e=t[6],t[6]=t[9],t[9]=e,e=t[3],t[3]=t[12],t[12]=e,e=t[7],t[7]=t[13],t[13]=e,e=t[11],t[11]=t[14],t[14]=e,this}setPosition(t,e,i){const s=this.elements;return t.isVector3?(s[12]=t.x,s[13]=t.y,s[14]=t.z):(s[12]=t,s[13]=e,s[14]=i),this}invert(){const t=this.elements,e=t[0],i=t[1],s=t[2],r=t[3],o=t[4],a=t[5],l=t[6],c=t[7],h=t[8],d=t[9],u=t[10],p=t[11],g=t[12],x=t[13],m=t[14],f=t[15],_=e*a-i*o,M=e*l-s*o,b=e*c-r*o,E=i*l-s*a,T=i*c-r*a,v=s*c-r*l,S=h*x-d*g,N=h*m-u*g,P=h*f-p*g,U=d*m-u*x,D=d*f-p*x,F=u*f-p*m,L=_*F-M*D+b*U+E*P-T*N+v*S;if(L===0)return this.set(0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0);const z=1/L;return t[0]=(a*F-l*D+c*U)*z,t[1]=(s*D-i*F-r*U)*z,t[2]=(x*v-m*T+f*E)*z,t[3]=(u*T-d*v-p*E)*z,t[4]=(l*P-o*F-c*N)*z,t[5]=(e*F-s*P+r*N)*z,t[6]=(m*b-g*v-f*M)*z,t[7]=(h*v-u*b+p*M)*z,t[8]=(o*D-a*P+c*S)*z,t[9]=(i*P-e*D-r*S)*z,t[10]=(g*T-x*b+f*_)*z,t[11]=(d*b-h*T-p*_)*z,t[12]=(a*N-o*U-l*S)*z,t[13]=(e*U-i*N+s*S)*z,t[14]=(x*M-g*E-m*_)*z,t[15]=(h*E-d*M+u*_)*z,this}scale(t){const e=this.elements,i=t.x,s=t.y,r=t.z;return e[0]*=i,e[4]*=s,e[8]*=r,e[1]*=i,e[5]*=s,e[9]*=r,e[2]*=i,e[6]*=s,e[10]*=r,e[3]*=i,e[7]*=s,e[11]*=r,this}getMaxScaleOnAxis(){const t=this.elements,e=t[0]*t[0]+t[1]*t[1]+t[2]*t[2],i=t[4]*t[4]+t[5]*t[5]+t[6]*t[6],s=t[8]*t[8]+t[9]*t[9]+t[10]*t[10];return Math.sqrt(Math.max(e,i,s))}makeTranslation(t,e,i){return t.isVector3?this.set(1,0,0,t.x,0,1,0,t.y,0,0,1,t.z,0,0,0,1):this.set(1,0,0,t,0,1,0,e,0,0,1,i,0,0,0,1),this}makeRotationX(t){const e=Math.cos(t),i=Math.sin(t);return this.set(1,0,0,0,0,e,-i,0,0,i,e,0,0,0,0,1),this}makeRotationY(t){const e=Math.cos(t),i=Math.sin(t);return this.set(e,0,i,0,0,1,0,0,-i,0,e,0,0,0,0,1),this}makeRotationZ(t){const e=Math.cos(t),i=Math.sin(t);return this.set(e,-i,0,0,i,e,0,0,0,0,1,0,0,0,0,1),this}makeRotationAxis(t,e){const i=Math.cos(e),s=Math.sin(e),r=1-i,o=t.x,a=t.y,l=t.z,c=r*o,h=r*a;return this.set(c*o+i,c*a-s*l,c*l+s*a,0,c*a+s*l,h*a+i,h*l-s*o,0,c*l-s*a,h*l+s*o,r*l*l+i,0,0,0,0,1),this}makeScale(t,e,i){return this.set(t,0,0,0,0,e,0,0,0,0,i,0,0,0,0,1),this}makeShear(t,e,i,s,r,o){return this.set(1,i,r,0,t,1,o,0,e,s,1,0,0,0,0,1),this}compose(t,e,i){const s=this.elements,r=e._x,o=e._y,a=e._z,l=e._w,c=r+r,h=o+o,d=a+a,u=r*c,p=r*h,g=r*d,x=o*h,m=o*d,f=a*d,_=l*c,M=l*h,b=l*d,E=i.x,T=i.y,v=i.z;return s[0]=(1-(x+f))*E,s[1]=(p+b)*E,s[2]=(g-M)*E,s[3]=0,s[4]=(p-b)*T,s[5]=(1-(u+f))*T,s[6]=(m+_)*T,s[7]=0,s[8]=(g+M)*v,s[9]=(m-_)*v,s[10]=(1-(u+x))*v,s[11]=0,s[12]=t.x,s[13]=t.y,s[14]=t.z,s[15]=1,this}decompose(t,e,i){const s=this.elements;t.x=s[12],t.y=s[13],t.z=s[14];const r=this.determinantAffine();if(r===0)return i.set(1,1,1),e.identity(),this;let o=ps.set(s[0],s[1],s[2]).length();const a=ps.set(s[4],s[5],s[6]).length(),l=ps.set(s[8],s[9],s[10]).length();r<0&&(o=-o),An.copy(this);const c=1/o,h=1/a,d=1/l;return An.elements[0]*=c,An.elements[1]*=c,An.elements[2]*=c,An.elements[4]*=h,An.elements[5]*=h,An.elements[6]*=h,An.elements[8]*=d,An.elements[9]*=d,An.elements[10]*=d,e.setFromRotationMatrix(An),i.x=o,i.y=a,i.z=l,this}makePerspective(t,e,i,s,r,o,a=Un,l=!1){const c=this.elements,h=2*r/(e-t),d=2*r/(i-s),u=(e+t)/(e-t),p=(i+s)/(i-s);let g,x;if(l)g=r/(o-r),x=o*r/(o-r);else if(a===Un)g=-(o+r)/(o-r),x=-2*o*r/(o-r);else if(a===ha)g=-o/(o-r),x=-o*r/(o-r);else throw new Error("THREE.Matrix4.makePerspective(): Invalid coordinate system: "+a);return c[0]=h,c[4]=0,c[8]=u,c[12]=0,c[1]=0,c[5]=d,c[9]=p,c[13]=0,c[2]=0,c[6]=0,c[10]=g,c[14]=x,c[3]=0,c[7]=0,c[11]=-1,c[15]=0,this}makeOrthographic(t,e,i,s,r,o,a=Un,l=!1){const c=this.elements,h=2/(e-t),d=2/(i-s),u=-(e+t)/(e-t),p=-(i+s)/(i-s);let g,x;if(l)g=1/(o-r),x=o/(o-r);else if(a===Un)g=-2/(o-r),x=-(o+r)/(o-r);else if(a===ha)g=-1/(o-r),x=-r/(o-r);else throw new Error("THREE.Matrix4.makeOrthographic(): Invalid coordinate system: "+a);return c[0]=h,c[4]=0,c[8]=0,c[12]=u,c[1]=0,c[5]=d,c[9]=0,c[13]=p,c[2]=0,c[6]=0,c[10]=g,c[14]=x,c[3]=0,c[7]=0,c[11]=0,c[15]=1,this}equals(t){const e=this.elements,i=t.elements;for(let s=0;s<16;s++)if(e[s]!==i[s])return!1;return!0}fromArray(t,e=0){for(let i=0;i<16;i++)this.elements[i]=t[i+e];return this}toArray(t=[],e=0){const i=this.elements;return t[e]=i[0],t[e+1]=i[1],t[e+2]=i[2],t[e+3]=i[3],t[e+4]=i[4],t[e+5]=i[5],t[e+6]=i[6],t[e+7]=i[7],t[e+8]=i[8],t[e+9]=i[9],t[e+10]=i[10],t[e+11]=i[11],t[e+12]=i[12],t[e+13]=i[13],t[e+14]=i[14],t[e+15]=i[15],t}}const ps=new C,An=new Yt,vv=new C(0,0,0),_v=new C(1,1,1),yi=new C,ho=new C,cn=new C,Su=new Yt,Eu=new ce;class Kn{constructor(t=0,e=0,i=0,s=Kn.DEFAULT_ORDER){this.isEuler=!0,this._x=t,this._y=e,this._z=i,this._order=s}get x(){return this._x}set x(t){this._x=t,this._onChangeCallback()}get y(){return this._y}set y(t){this._y=t,this._onChangeCallback()}get z(){return this._z}set z(t){this._z=t,this._onChangeCallback()}get order(){return this._order}set order(t){this._order=t,this._onChangeCallback()}set(t,e,i,s=this._order){return this._x=t,this._y=e,this._z=i,this._order=s,this._onChangeCallback(),this}clone(){return new this.constructor(this._x,this._y,this._z,this._order)}copy(t){return this._x=t._x,this._y=t._y,this._z=t._z,this._order=t._order,this._onChangeCallback(),this}setFromRotationMatrix(t,e=this._order,i=!0){const s=t.elements,r=s[0],o=s[4],a=s[8],l=s[1],c=s[5],h=s[9],d=s[2],u=s[6],p=s[10];switch(e){case"XYZ":this._y=Math.asin(Ht(a,-1,1)),Math.abs(a)<.9999999?(this._x=Math.atan2(-h,p),this._z=Math.atan2(-o,r)):(this._x=Math.atan2(u,c),this._z=0);break;case"YXZ":this._x=Math.asin(-Ht(h,-1,1)),Math.abs(h)<.9999999?(this._y=Math.atan2(a,p),this._z=Math.atan2(l,c)):(this._y=Math.atan2(-d,r),this._z=0);break;case"ZXY":this._x=Math.asin(Ht(u,-1,1)),Math.abs(u)<.9999999?(this._y=Math.atan2(-d,p),this._z=Math.atan2(-o,c)):(this._y=0,this._z=Math.atan2(l,r));break;case"ZYX":this._y=Math.asin(-Ht(d,-1,1)),Math.abs(d)<.9999999?(this._x=Math.atan2(u,p),this._z=Math.atan2(l,r)):(this._x=0,this._z=Math.atan2(-o,c));break;case"YZX":this._z=Math.asin(Ht(l,-1,1)),Math.abs(l)<.9999999?(this._x=Math.atan2(-h,c),this._y=Math.atan2(-d,r)):(this._x=0,this._y=Math.atan2(a,p));break;case"XZY":this._z=Math.asin(-Ht(o,-1,1)),Math.abs(o)<.9999999?(this._x=Math.atan2(u,c),this._y=Math.atan2(a,r)):(this._x=Math.atan2(-h,p),this._y=0);break;default:Dt("Euler: .setFromRotationMatrix() encountered an unknown order: "+e)}return this._order=e,i===!0&&this._onChangeCallback(),this}setFromQuaternion(t,e,i){return Su.makeRotationFromQuaternion(t),this.setFromRotationMatrix(Su,e,i)}setFromVector3(t,e=this._order){return this.set(t.x,t.y,t.z,e)}reorder(t){return Eu.setFromEuler(this),this.setFromQuaternion(Eu,t)}equals(t){return t._x===this._x&&t._y===this._y&&t._z===this._z&&t._order===this._order}fromArray(t){return this._x=t[0],this._y=t[1],this._z=t[2],t[3]!==void 0&&(this._order=t[3]),this._onChangeCallback(),this}toArray(t=[],e=0){return t[e]=this._x,t[e+1]=this._y,t[e+2]=this._z,t[e+3]=this._order,t}_onChange(t){return this._onChangeCallback=t,this}_onChangeCallback(){}*[Symbol.iterator](){yield this._x,yield this._y,yield this._z,yield this._order}}Kn.DEFAULT_ORDER="XYZ";class eh{constructor(){this.mask=1}set(t){this.mask=(1<<t|0)>>>0}enable(t){this.mask|=1<<t|0}enableAll(){this.mask=-1}toggle(t){this.mask^=1<<t|0}disable(t){this.mask&=~(1<<t|0)}disableAll(){this.mask=0}test(t){return(this.mask&t.mask)!==0}isEnabled(t){return(this.mask&(1<<t|0))!==0}}let xv=0;const Mu=new C,fs=new ce,ti=new Yt,uo=new C,or=new C,bv=new C,wv=new ce,Tu=new C(1,0,0),Au=new C(0,1,0),Cu=new C(0,0,1),Ru={type:"added"},yv={type:"removed"},ms={type:"childadded",child:null},ja={type:"childremoved",child:null};class Ne extends Gi{constructor(){super(),this.isObject3D=!0,Object.defineProperty(this,"id",{value:xv++}),this.uuid=Ks(),this.name="",this.type="Object3D",this.parent=null,this.children=[],this.up=Ne.DEFAULT_UP.clone();const t=new C,e=new Kn,i=new ce,s=new C(1,1,1);function r(){i.setFromEuler(e,!1)}function o(){e.setFromQuaternion(i,void 0,!1)}e._onChange(r),i._onChange(o),Object.defineProperties(this,{position:{configurable:!0,enumerable:!0,value:t},rotation:{configurable:!0,enumerable:!0,value:e},quaternion:{configurable:!0,enumerable:!0,value:i},scale:{configurable:!0,enumerable:!0,value:s},modelViewMatrix:{value:new Yt},normalMatrix:{value:new Lt}}),this.matrix=new Yt,this.matrixWorld=new Yt,this.matrixAutoUpdate=Ne.DEFAULT_MATRIX_AUTO_UPDATE,this.matrixWorldAutoUpdate=Ne.DEFAULT_MATRIX_WORLD_AUTO_UPDATE,this.matrixWorldNeedsUpdate=!1,this.layers=new eh,this.visible=!0,this.castShadow=!1,this.receiveShadow=!1,this.frustumCulled=!0,this.renderOrder=0,this.animations=[],this.customDepthMaterial=void 0,this.customDistanceMaterial=void 0,this.static=!1,this.userData={},this.pivot=null}onBeforeShadow(){}onAfterShadow(){}onBeforeRender(){}onAfterRender(){}applyMatrix4(t){this.matrixAutoUpdate&&this.updateMatrix(),this.matrix.premultiply(t),this.matrix.decompose(this.position,this.quaternion,this.scale),this.pivot!==null&&this.position.copy(this.pivot).applyMatrix4(this.matrix).sub(this.pivot)}applyQuaternion(t){return this.quaternion.premultiply(t),this}setRotationFromAxisAngle(t,e){this.quaternion.setFromAxisAngle(t,e)}setRotationFromEuler(t){this.quaternion.setFromEuler(t,!0)}setRotationFromMatrix(t){this.quaternion.setFromRotationMatrix(t)}setRotationFromQuaternion(t){this.quaternion.copy(t)}rotateOnAxis(t,e){return fs.setFromAxisAngle(t,e),this.quaternion.multiply(fs),this}rotateOnWorldAxis(t,e){return fs.setFromAxisAngle(t,e),this.quaternion.premultiply(fs),this}rotateX(t){return this.rotateOnAxis(Tu,t)}rotateY(t){return this.rotateOnAxis(Au,t)}rotateZ(t){return this.rotateOnAxis(Cu,t)}translateOnAxis(t,e){return Mu.copy(t).applyQuaternion(this.quaternion),this.position.add(Mu.multiplyScalar(e)),this}translateX(t){return this.translateOnAxis(Tu,t)}translateY(t){return this.translateOnAxis(Au,t)}translateZ(t){return this.translateOnAxis(Cu,t)}localToWorld(t){return this.updateWorldMatrix(!0,!1),t.applyMatrix4(this.matrixWorld)}worldToLocal(t){return this.updateWorldMatrix(!0,!1),t.applyMatrix4(ti.copy(this.matrixWorld).invert())}lookAt(t,e,i){t.isVector3?uo.copy(t):uo.set(t,e,i);const s=this.parent;this.updateWorldMatrix(!0,!1),or.setFromMatrixPosition(this.matrixWorld),this.isCamera||this.isLight?ti.lookAt(or,uo,this.up):ti.lookAt(uo,or,this.up),this.quaternion.setFromRotationMatrix(ti),s&&(ti.extractRotation(s.matrixWorld),fs.setFromRotationMatrix(ti),this.quaternion.premultiply(fs.invert()))}add(t){if(arguments.length>1){for(let e=0;e<arguments.length;e++)this.add(arguments[e]);return this}return t===this?(Qt("Object3D.add: object can't be added as a child of itself.",t),this):(t&&t.isObject3D?(t.removeFromParent(),t.parent=this,this.children.push(t),t.dispatchEvent(Ru),ms.child=t,this.dispatchEvent(ms),ms.child=null):Qt("Object3D.add: object not an instance of THREE.Object3D.",t),this)}remove(t){if(arguments.length>1){for(let i=0;i<arguments.length;i++)this.remove(arguments[i]);return this}const e=this.children.indexOf(t);return e!==-1&&(t.parent=null,this.children.splice(e,1),t.dispatchEvent(yv),ja.child=t,this.dispatchEvent(ja),ja.child=null),this}removeFromParent(){const t=this.parent;return t!==null&&t.remove(this),this}clear(){return this.remove(...this.children)}attach(t){return this.updateWorldMatrix(!0,!1),ti.copy(this.matrixWorld).invert(),t.parent!==null&&(t.parent.updateWorldMatrix(!0,!1),ti.multiply(t.parent.matrixWorld)),t.applyMatrix4(ti),t.removeFromParent(),t.parent=this,this.children.push(t),t.updateWorldMatrix(!1,!0),t.dispatchEvent(Ru),ms.child=t,this.dispatchEvent(ms),ms.child=null,this}getObjectById(t){return this.getObjectByProperty("id",t)}getObjectByName(t){return this.getObjectByProperty("name",t)}getObjectByProperty(t,e){if(this[t]===e)return this;for(let i=0,s=this.children.length;i<s;i++){const o=this.children[i].getObjectByProperty(t,e);if(o!==void 0)return o}}getObjectsByProperty(t,e,i=[]){this[t]===e&&i.push(this);const s=this.children;for(let r=0,o=s.length;r<o;r++)s[r].getObjectsByProperty(t,e,i);return i}getWorldPosition(t){return this.updateWorldMatrix(!0,!1),t.setFromMatrixPosition(this.matrixWorld)}getWorldQuaternion(t){return this.updateWorldMatrix(!0,!1),this.matrixWorld.decompose(or,t,bv),t}getWorldScale(t){return this.updateWorldMatrix(!0,!1),this.matrixWorld.decompose(or,wv,t),t}getWorldDirection(t){this.updateWorldMatrix(!0,!1);const e=this.matrixWorld.elements;return t.set(e[8],e[9],e[10]).normalize()}raycast(){}intersectsFrustum(){return!0}traverse(t){t(this);const e=this.children;for(let i=0,s=e.length;i<s;i++)e[i].traverse(t)}traverseVisible(t){if(this.visible===!1)return;t(this);const e=this.children;for(let i=0,s=e.length;i<s;i++)e[i].traverseVisible(t)}traverseAncestors(t){const e=this.parent;e!==null&&(t(e),e.traverseAncestors(t))}updateMatrix(){this.matrix.compose(this.position,this.quaternion,this.scale);const t=this.pivot;if(t!==null){const e=t.x,i=t.y,s=t.z,r=this.matrix.elements;r[12]+=e-r[0]*e-r[4]*i-r[8]*s,r[13]+=i-r[1]*e-r[5]*i-r[9]*s,r[14]+=s-r[2]*e-r[6]*i-r[10]*s}this.matrixWorldNeedsUpdate=!0}updateMatrixWorld(t){this.matrixAutoUpdate&&this.updateMatrix(),(this.matrixWorldNeedsUpdate||t)&&(this.matrixWorldAutoUpdate===!0&&(this.parent===null?this.matrixWorld.copy(this.matrix):this.matrixWorld.multiplyMatrices(this.parent.matrixWorld,this.matrix)),this.matrixWorldNeedsUpdate=!1,t=!0);const e=this.children;for(let i=0,s=e.length;i<s;i++)e[i].updateMatrixWorld(t)}updateWorldMatrix(t,e,i=!1){const s=this.parent;if(t===!0&&s!==null&&s.updateWorldMatrix(!0,!1),this.matrixAutoUpdate&&this.updateMatrix(),(this.matrixWorldNeedsUpdate||i)&&(this.matrixWorldAutoUpdate===!0&&(this.parent===null?this.matrixWorld.copy(this.matrix):this.matrixWorld.multiplyMatrices(this.parent.matrixWorld,this.matrix)),this.matrixWorldNeedsUpdate=!1,i=!0),e===!0){const r=this.children;for(let o=0,a=r.length;o<a;o++)r[o].updateWorldMatrix(!1,!0,i)}}toJSON(t){const e=t===void 0||typeof t=="string",i={};e&&(t={geometries:{},materials:{},textures:{},images:{},shapes:{},skeletons:{},animations:{},nodes:{}},i.metadata={version:4.7,type:"Object",generator:"Object3D.toJSON"});const s={};s.uuid=this.uuid,s.type=this.type,s.name=this.name,s.castShadow=this.castShadow,s.receiveShadow=this.receiveShadow,s.visible=this.visible,s.frustumCulled=this.frustumCulled,s.renderOrder=this.renderOrder,s.static=this.static,s.matrixAutoUpdate=this.matrixAutoUpdate,Object.keys(this.userData).length>0&&(s.userData=this.userData),s.layers=this.layers.mask,s.matrix=this.matrix.toArray(),s.up=this.up.toArray(),this.pivot!==null&&(s.pivot=this.pivot.toArray()),this.morphTargetDictionary!==void 0&&(s.morphTargetDictionary=Object.assign({},this.morphTargetDictionary)),this.morphTargetInfluences!==void 0&&(s.morphTargetInfluences=this.morphTargetInfluences.slice()),this.isInstancedMesh&&(s.type="InstancedMesh",s.count=this.count,s.instanceMatrix=this.instanceMatrix.toJSON(),this.instanceColor!==null&&(s.instanceColor=this.instanceColor.toJSON())),this.isBatchedMesh&&(s.type="BatchedMesh",s.perObjectFrustumCulled=this.perObjectFrustumCulled,s.sortObjects=this.sortObjects,s.drawRanges=this._drawRanges,s.reservedRanges=this._reservedRanges,s.geometryInfo=this._geometryInfo.map(a=>({...a,boundingBox:a.boundingBox?a.boundingBox.toJSON():void 0,boundingSphere:a.boundingSphere?a.boundingSphere.toJSON():void 0})),s.instanceInfo=this._instanceInfo.map(a=>({...a})),s.availableInstanceIds=this._availableInstanceIds.slice(),s.availableGeometryIds=this._availableGeometryIds.slice(),s.nextIndexStart=this._nextIndexStart,s.nextVertexStart=this._nextVertexStart,s.geometryCount=this._geometryCount,s.maxInstanceCount=this._maxInstanceCount,s.maxVertexCount=this._maxVertexCount,s.maxIndexCount=this._maxIndexCount,s.geometryInitialized=this._geometryInitialized,s.matricesTexture=this._matricesTexture.toJSON(t),s.indirectTexture=this._indirectTexture.toJSON(t),this._colorsTexture!==null&&(s.colorsTexture=this._colorsTexture.toJSON(t)),this.boundingSphere!==null&&(s.boundingSphere=this.boundingSphere.toJSON()),this.boundingBox!==null&&(s.boundingBox=this.boundingBox.toJSON()));function r(a,l){return a[l.uuid]===void 0&&(a[l.uuid]=l.toJSON(t)),l.uuid}if(this.isScene)this.background&&(this.background.isColor?s.background=this.background.toJSON():this.background.isTexture&&(s.background=this.background.toJSON(t).uuid)),this.environment&&this.environment.isTexture&&this.environment.isRenderTargetTexture!==!0&&(s.environment=this.environment.toJSON(t).uuid);else if(this.isMesh||this.isLine||this.isPoints){s.geometry=r(t.geometries,this.geometry);const a=this.geometry.parameters;if(a!==void 0&&a.shapes!==void 0){const l=a.shapes;if(Array.isArray(l))for(let c=0,h=l.length;c<h;c++){const d=l[c];r(t.shapes,d)}else r(t.shapes,l)}}if(this.isSkinnedMesh&&(s.bindMode=this.bindMode,s.bindMatrix=this.bindMatrix.toArray(),this.skeleton!==void 0&&(r(t.skeletons,this.skeleton),s.skeleton=this.skeleton.uuid)),this.material!==void 0)if(Array.isArray(this.material)){const a=[];for(let l=0,c=this.material.length;l<c;l++)a.push(r(t.materials,this.material[l]));s.material=a}else s.material=r(t.materials,this.material);if(this.children.length>0){s.children=[];for(let a=0;a<this.children.length;a++)s.children.push(this.children[a].toJSON(t).object)}if(this.animations.length>0){s.animations=[];for(let a=0;a<this.animations.length;a++){const l=this.animations[a];s.animations.push(r(t.animations,l))}}if(e){const a=o(t.geometries),l=o(t.materials),c=o(t.textures),h=o(t.images),d=o(t.shapes),u=o(t.skeletons),p=o(t.animations),g=o(t.nodes);a.length>0&&(i.geometries=a),l.length>0&&(i.materials=l),c.length>0&&(i.textures=c),h.length>0&&(i.images=h),d.length>0&&(i.shapes=d),u.length>0&&(i.skeletons=u),p.length>0&&(i.animations=p),g.length>0&&(i.nodes=g)}return i.object=s,i;function o(a){const l=[];for(const c in a){const h=a[c];delete h.metadata,l.push(h)}return l}}clone(t){return new this.constructor().copy(this,t)}copy(t,e=!0){if(this.name=t.name,this.up.copy(t.up),this.position.copy(t.position),this.rotation.order=t.rotation.order,this.quaternion.copy(t.quaternion),this.scale.copy(t.scale),this.pivot=t.pivot!==null?t.pivot.clone():null,this.matrix.copy(t.matrix),this.matrixWorld.copy(t.matrixWorld),this.matrixAutoUpdate=t.matrixAutoUpdate,this.matrixWorldAutoUpdate=t.matrixWorldAutoUpdate,this.matrixWorldNeedsUpdate=t.matrixWorldNeedsUpdate,this.layers.mask=t.layers.mask,this.visible=t.visible,this.castShadow=t.castShadow,this.receiveShadow=t.receiveShadow,this.frustumCulled=t.frustumCulled,this.renderOrder=t.renderOrder,this.static=t.static,this.animations=t.animations.slice(),this.userData=JSON.parse(JSON.stringify(t.userData)),e===!0)for(let i=0;i<t.children.length;i++){const s=t.children[i];this.add(s.clone())}return this}dispose(){this.dispatchEvent({type:"dispose"})}}Ne.DEFAULT_UP=new C(0,1,0);Ne.DEFAULT_MATRIX_AUTO_UPDATE=!0;Ne.DEFAULT_MATRIX_WORLD_AUTO_UPDATE=!0;class po extends Ne{constructor(){super(),this.isGroup=!0,this.type="Group"}}const Sv={type:"move"};class Qa{constructor(){this._targetRay=null,this._grip=null,this._hand=null}getHandSpace(){return this._hand===null&&(this._hand=new po,this._hand.matrixAutoUpdate=!1,this._hand.visible=!1,this._hand.joints={},this._hand.inputState={pinching:!1}),this._hand}getTargetRaySpace(){return this._targetRay===null&&(this._targetRay=new po,this._targetRay.matrixAutoUpdate=!1,this._targetRay.visible=!1,this._targetRay.hasLinearVelocity=!1,this._targetRay.linearVelocity=new C,this._targetRay.hasAngularVelocity=!1,this._targetRay.angularVelocity=new C),this._targetRay}getGripSpace(){return this._grip===null&&(this._grip=new po,this._grip.matrixAutoUpdate=!1,this._grip.visible=!1,this._grip.hasLinearVelocity=!1,this._grip.linearVelocity=new C,this._grip.hasAngularVelocity=!1,this._grip.angularVelocity=new C,this._grip.eventsEnabled=!1),this._grip}dispatchEvent(t){return this._targetRay!==null&&this._targetRay.dispatchEvent(t),this._grip!==null&&this._grip.dispatchEvent(t),this._hand!==null&&this._hand.dispatchEvent(t),this}connect(t){if(t&&t.hand){const e=this._hand;if(e)for(const i of t.hand.values())this._getHandJoint(e,i)}return this.dispatchEvent({type:"connected",data:t}),this}disconnect(t){return this.dispatchEvent({type:"disconnected",data:t}),this._targetRay!==null&&(this._targetRay.visible=!1),this._grip!==null&&(this._grip.visible=!1),this._hand!==null&&(this._hand.visible=!1),this}update(t,e,i){let s=null,r=null,o=null;const a=this._targetRay,l=this._grip,c=this._hand;if(t&&e.session.visibilityState!=="visible-blurred"){if(c&&t.hand){o=!0;for(const x of t.hand.values()){const m=e.getJointPose(x,i),f=this._getHandJoint(c,x);m!==null&&(f.matrix.fromArray(m.transform.matrix),f.matrix.decompose(f.position,f.quaternion,f.scale),f.matrixWorldNeedsUpdate=!0,f.jointRadius=m.radius),f.visible=m!==null}const h=c.joints["index-finger-tip"],d=c.joints["thumb-tip"],u=h.position.distanceTo(d.position),p=.02,g=.005;c.inputState.pinching&&u>p+g?(c.inputState.pinching=!1,this.dispatchEvent({type:"pinchend",handedness:t.handedness,target:this})):!c.inputState.pinching&&u<=p-g&&(c.inputState.pinching=!0,this.dispatchEvent({type:"pinchstart",handedness:t.handedness,target:this}))}else l!==null&&t.gripSpace&&(r=e.getPose(t.gripSpace,i),r!==null&&(l.matrix.fromArray(r.transform.matrix),l.matrix.decompose(l.position,l.quaternion,l.scale),l.matrixWorldNeedsUpdate=!0,r.linearVelocity?(l.hasLinearVelocity=!0,l.linearVelocity.copy(r.linearVelocity)):l.hasLinearVelocity=!1,r.angularVelocity?(l.hasAngularVelocity=!0,l.angularVelocity.copy(r.angularVelocity)):l.hasAngularVelocity=!1,l.eventsEnabled&&l.dispatchEvent({type:"gripUpdated",data:t,target:this})));a!==null&&(s=e.getPose(t.targetRaySpace,i),s===null&&r!==null&&(s=r),s!==null&&(a.matrix.fromArray(s.transform.matrix),a.matrix.decompose(a.position,a.quaternion,a.scale),a.matrixWorldNeedsUpdate=!0,s.linearVelocity?(a.hasLinearVelocity=!0,a.linearVelocity.copy(s.linearVelocity)):a.hasLinearVelocity=!1,s.angularVelocity?(a.hasAngularVelocity=!0,a.angularVelocity.copy(s.angularVelocity)):a.hasAngularVelocity=!1,this.dispatchEvent(Sv)))}return a!==null&&(a.visible=s!==null),l!==null&&(l.visible=r!==null),c!==null&&(c.visible=o!==null),this}_getHandJoint(t,e){if(t.joints[e.jointName]===void 0){const i=new po;i.matrixAutoUpdate=!1,i.visible=!1,t.joints[e.jointName]=i,t.add(i)}return t.joints[e.jointName]}}const gf={aliceblue:15792383,antiquewhite:16444375,aqua:65535,aquamarine:8388564,azure:15794175,beige:16119260,bisque:16770244,black:0,blanchedalmond:16772045,blue:255,blueviolet:9055202,brown:10824234,burlywood:14596231,cadetblue:6266528,chartreuse:8388352,chocolate:13789470,coral:16744272,cornflowerblue:6591981,cornsilk:16775388,crimson:14423100,cyan:65535,darkblue:139,darkcyan:35723,darkgoldenrod:12092939,darkgray:11119017,darkgreen:25600,darkgrey:11119017,darkkhaki:12433259,darkmagenta:9109643,darkolivegreen:5597999,darkorange:16747520,darkorchid:10040012,darkred:9109504,darksalmon:15308410,darkseagreen:9419919,darkslateblue:4734347,darkslategray:3100495,darkslategrey:3100495,darkturquoise:52945,darkviolet:9699539,deeppink:16716947,deepskyblue:49151,dimgray:6908265,dimgrey:6908265,dodgerblue:2003199,firebrick:11674146,floralwhite:16775920,forestgreen:2263842,fuchsia:16711935,gainsboro:14474460,ghostwhite:16316671,gold:16766720,goldenrod:14329120,gray:8421504,green:32768,greenyellow:11403055,grey:8421504,honeydew:15794160,hotpink:16738740,indianred:13458524,indigo:4915330,ivory:16777200,khaki:15787660,lavender:15132410,lavenderblush:16773365,lawngreen:8190976,lemonchiffon:16775885,lightblue:11393254,lightcoral:15761536,lightcyan:14745599,lightgoldenrodyellow:16448210,lightgray:13882323,lightgreen:9498256,lightgrey:13882323,lightpink:16758465,lightsalmon:16752762,lightseagreen:2142890,lightskyblue:8900346,lightslategray:7833753,lightslategrey:7833753,lightsteelblue:11584734,lightyellow:16777184,lime:65280,limegreen:3329330,linen:16445670,magenta:16711935,maroon:8388608,mediumaquamarine:6737322,mediumblue:205,mediumorchid:12211667,mediumpurple:9662683,mediumseagreen:3978097,mediumslateblue:8087790,mediumspringgreen:64154,mediumturquoise:4772300,mediumvioletred:13047173,midnightblue:1644912,mintcream:16121850,mistyrose:16770273,moccasin:16770229,navajowhite:16768685,navy:128,oldlace:16643558,olive:8421376,olivedrab:7048739,orange:16753920,orangered:16729344,orchid:14315734,palegoldenrod:15657130,palegreen:10025880,paleturquoise:11529966,palevioletred:14381203,papayawhip:16773077,peachpuff:16767673,peru:13468991,pink:16761035,plum:14524637,powderblue:11591910,purple:8388736,rebeccapurple:6697881,red:16711680,rosybrown:12357519,royalblue:4286945,saddlebrown:9127187,salmon:16416882,sandybrown:16032864,seagreen:3050327,seashell:16774638,sienna:10506797,silver:12632256,skyblue:8900331,slateblue:6970061,slategray:7372944,slategrey:7372944,snow:16775930,springgreen:65407,steelblue:4620980,tan:13808780,teal:32896,thistle:14204888,tomato:16737095,turquoise:4251856,violet:15631086,wheat:16113331,white:16777215,whitesmoke:16119285,yellow:16776960,yellowgreen:10145074},Si={h:0,s:0,l:0},fo={h:0,s:0,l:0};function Ja(n,t,e){return e<0&&(e+=1),e>1&&(e-=1),e<1/6?n+(t-n)*6*e:e<1/2?t:e<2/3?n+(t-n)*6*(2/3-e):n}class Zt{constructor(t,e,i){return this.isColor=!0,this.r=1,this.g=1,this.b=1,this.set(t,e,i)}set(t,e,i){if(e===void 0&&i===void 0){const s=t;s&&s.isColor?this.copy(s):typeof s=="number"?this.setHex(s):typeof s=="string"&&this.setStyle(s)}else this.setRGB(t,e,i);return this}setScalar(t){return this.r=t,this.g=t,this.b=t,this}setHex(t,e=wn){return t=Math.floor(t),this.r=(t>>16&255)/255,this.g=(t>>8&255)/255,this.b=(t&255)/255,qt.colorSpaceToWorking(this,e),this}setRGB(t,e,i,s=qt.workingColorSpace){return this.r=t,this.g=e,this.b=i,qt.colorSpaceToWorking(this,s),this}setHSL(t,e,i,s=qt.workingColorSpace){if(t=Qc(t,1),e=Ht(e,0,1),i=Ht(i,0,1),e===0)this.r=this.g=this.b=i;else{const r=i<=.5?i*(1+e):i+e-i*e,o=2*i-r;this.r=Ja(o,r,t+1/3),this.g=Ja(o,r,t),this.b=Ja(o,r,t-1/3)}return qt.colorSpaceToWorking(this,s),this}setStyle(t,e=wn){function i(r){r!==void 0&&parseFloat(r)<1&&Dt("Color: Alpha component of "+t+" will be ignored.")}let s;if(s=/^(\w+)\(([^\)]*)\)/.exec(t)){let r;const o=s[1],a=s[2];switch(o){case"rgb":case"rgba":if(r=/^\s*(\d+)\s*,\s*(\d+)\s*,\s*(\d+)\s*(?:,\s*(\d+(?:\.\d+)?|\.\d+)\s*)?$/.exec(a))return i(r[4]),this.setRGB(Math.min(255,parseInt(r[1],10))/255,Math.min(255,parseInt(r[2],10))/255,Math.min(255,parseInt(r[3],10))/255,e);if(r=/^\s*(\d+(?:\.\d+)?|\.\d+)\%\s*,\s*(\d+(?:\.\d+)?|\.\d+)\%\s*,\s*(\d+(?:\.\d+)?|\.\d+)\%\s*(?:,\s*(\d+(?:\.\d+)?|\.\d+)\s*)?$/.exec(a))return i(r[4]),this.setRGB(Math.min(100,parseFloat(r[1]))/100,Math.min(100,parseFloat(r[2]))/100,Math.min(100,parseFloat(r[3]))/100,e);break;case"hsl":case"hsla":if(r=/^\s*([+-]?(?:\d+(?:\.\d+)?|\.\d+))\s*,\s*(\d+(?:\.\d+)?|\.\d+)\%\s*,\s*(\d+(?:\.\d+)?|\.\d+)\%\s*(?:,\s*(\d+(?:\.\d+)?|\.\d+)\s*)?$/.exec(a))return i(r[4]),this.setHSL(parseFloat(r[1])/360,parseFloat(r[2])/100,parseFloat(r[3])/100,e);break;default:Dt("Color: Unknown color model "+t)}}else if(s=/^\#([A-Fa-f\d]+)$/.exec(t)){const r=s[1],o=r.length;if(o===3)return this.setRGB(parseInt(r.charAt(0),16)/15,parseInt(r.charAt(1),16)/15,parseInt(r.charAt(2),16)/15,e);if(o===6)return this.setHex(parseInt(r,16),e);Dt("Color: Invalid hex color "+t)}else if(t&&t.length>0)return this.setColorName(t,e);return this}setColorName(t,e=wn){const i=gf[t.toLowerCase()];return i!==void 0?this.setHex(i,e):Dt("Color: Unknown color "+t),this}clone(){return new this.constructor(this.r,this.g,this.b)}copy(t){return this.r=t.r,this.g=t.g,this.b=t.b,this}copySRGBToLinear(t){return this.r=hi(t.r),this.g=hi(t.g),this.b=hi(t.b),this}copyLinearToSRGB(t){return this.r=Us(t.r),this.g=Us(t.g),this.b=Us(t.b),this}convertSRGBToLinear(){return this.copySRGBToLinear(this),this}convertLinearToSRGB(){return this.copyLinearToSRGB(this),this}getHex(t=wn){return qt.workingToColorSpace(Ke.copy(this),t),Math.round(Ht(Ke.r*255,0,255))*65536+Math.round(Ht(Ke.g*255,0,255))*256+Math.round(Ht(Ke.b*255,0,255))}getHexString(t=wn){return("000000"+this.getHex(t).toString(16)).slice(-6)}getHSL(t,e=qt.workingColorSpace){qt.workingToColorSpace(Ke.copy(this),e);const i=Ke.r,s=Ke.g,r=Ke.b,o=Math.max(i,s,r),a=Math.min(i,s,r);let l,c;const h=(a+o)/2;if(a===o)l=0,c=0;else{const d=o-a;switch(c=h<=.5?d/(o+a):d/(2-o-a),o){case i:l=(s-r)/d+(s<r?6:0);break;case s:l=(r-i)/d+2;break;case r:l=(i-s)/d+4;break}l/=6}return t.h=l,t.s=c,t.l=h,t}getRGB(t,e=qt.workingColorSpace){return qt.workingToColorSpace(Ke.copy(this),e),t.r=Ke.r,t.g=Ke.g,t.b=Ke.b,t}getStyle(t=wn){qt.workingToColorSpace(Ke.copy(this),t);const e=Ke.r,i=Ke.g,s=Ke.b;return t!==wn?`color(${t} ${e.toFixed(3)} ${i.toFixed(3)} ${s.toFixed(3)})`:`rgb(${Math.round(e*255)},${Math.round(i*255)},${Math.round(s*255)})`}offsetHSL(t,e,i){return this.getHSL(Si),this.setHSL(Si.h+t,Si.s+e,Si.l+i)}add(t){return this.r+=t.r,this.g+=t.g,this.b+=t.b,this}addColors(t,e){return this.r=t.r+e.r,this.g=t.g+e.g,this.b=t.b+e.b,this}addScalar(t){return this.r+=t,this.g+=t,this.b+=t,this}sub(t){return this.r=Math.max(0,this.r-t.r),this.g=Math.max(0,this.g-t.g),this.b=Math.max(0,this.b-t.b),this}multiply(t){return this.r*=t.r,this.g*=t.g,this.b*=t.b,this}multiplyScalar(t){return this.r*=t,this.g*=t,this.b*=t,this}lerp(t,e){return this.r+=(t.r-this.r)*e,this.g+=(t.g-this.g)*e,this.b+=(t.b-this.b)*e,this}lerpColors(t,e,i){return this.r=t.r+(e.r-t.r)*i,this.g=t.g+(e.g-t.g)*i,this.b=t.b+(e.b-t.b)*i,this}lerpHSL(t,e){this.getHSL(Si),t.getHSL(fo);const i=Cr(Si.h,fo.h,e),s=Cr(Si.s,fo.s,e),r=Cr(Si.l,fo.l,e);return this.setHSL(i,s,r),this}setFromVector3(t){return this.r=t.x,this.g=t.y,this.b=t.z,this}applyMatrix3(t){const e=this.r,i=this.g,s=this.b,r=t.elements;return this.r=r[0]*e+r[3]*i+r[6]*s,this.g=r[1]*e+r[4]*i+r[7]*s,this.b=r[2]*e+r[5]*i+r[8]*s,this}equals(t){return t.r===this.r&&t.g===this.g&&t.b===this.b}fromArray(t,e=0){return this.r=t[e],this.g=t[e+1],this.b=t[e+2],this}toArray(t=[],e=0){return t[e]=this.r,t[e+1]=this.g,t[e+2]=this.b,t}fromBufferAttribute(t,e){return this.r=t.getX(e),this.g=t.getY(e),this.b=t.getZ(e),this}toJSON(){return this.getHex()}*[Symbol.iterator](){yield this.r,yield this.g,yield this.b}}const Ke=new Zt;Zt.NAMES=gf;class nh extends Ne{constructor(){super(),this.isScene=!0,this.type="Scene",this.background=null,this.environment=null,this.fog=null,this.backgroundBlurriness=0,this.backgroundIntensity=1,this.backgroundRotation=new Kn,this.environmentIntensity=1,this.environmentRotation=new Kn,this.overrideMaterial=null,typeof __THREE_DEVTOOLS__<"u"&&__THREE_DEVTOOLS__.dispatchEvent(new CustomEvent("observe",{detail:this}))}copy(t,e){return super.copy(t,e),this.background=t.background!==null?t.background.clone():null,this.environment=t.environment!==null?t.environment.clone():null,this.fog=t.fog!==null?t.fog.clone():null,this.backgroundBlurriness=t.backgroundBlurriness,this.backgroundIntensity=t.backgroundIntensity,this.backgroundRotation.copy(t.backgroundRotation),this.environmentIntensity=t.environmentIntensity,this.environmentRotation.copy(t.environmentRotation),this.overrideMaterial=t.overrideMaterial!==null?t.overrideMaterial.clone():null,this.matrixAutoUpdate=t.matrixAutoUpdate,this}toJSON(t){const e=super.toJSON(t);return this.fog!==null&&(e.object.fog=this.fog.toJSON()),e.object.backgroundBlurriness=this.backgroundBlurriness,e.object.backgroundIntensity=this.backgroundIntensity,e.object.backgroundRotation=this.backgroundRotation.toArray(),e.object.environmentIntensity=this.environmentIntensity,e.object.environmentRotation=this.environmentRotation.toArray(),e}}const Cn=new C,ei=new C,tl=new C,ni=new C,gs=new C,vs=new C,Pu=new C,el=new C,nl=new C,il=new C,sl=new Ee,rl=new Ee,ol=new Ee;class Ln{constructor(t=new C,e=new C,i=new C){this.a=t,this.b=e,this.c=i}static getNormal(t,e,i,s){s.subVectors(i,e),Cn.subVectors(t,e),s.cross(Cn);const r=s.lengthSq();return r>0?s.multiplyScalar(1/Math.sqrt(r)):s.set(0,0,0)}static getBarycoord(t,e,i,s,r){Cn.subVectors(s,e),ei.subVectors(i,e),tl.subVectors(t,e);const o=Cn.dot(Cn),a=Cn.dot(ei),l=Cn.dot(tl),c=ei.dot(ei),h=ei.dot(tl),d=o*c-a*a;if(d===0)return r.set(0,0,0),null;const u=1/d,p=(c*l-a*h)*u,g=(o*h-a*l)*u;return r.set(1-p-g,g,p)}static containsPoint(t,e,i,s){return this.getBarycoord(t,e,i,s,ni)===null?!1:ni.x>=0&&ni.y>=0&&ni.x+ni.y<=1}static getInterpolation(t,e,i,s,r,o,a,l){return this.getBarycoord(t,e,i,s,ni)===null?(l.x=0,l.y=0,"z"in l&&(l.z=0),"w"in l&&(l.w=0),null):(l.setScalar(0),l.addScaledVector(r,ni.x),l.addScaledVector(o,ni.y),l.addScaledVector(a,ni.z),l)}static getInterpolatedAttribute(t,e,i,s,r,o){return sl.setScalar(0),rl.setScalar(0),ol.setScalar(0),sl.fromBufferAttribute(t,e),rl.fromBufferAttribute(t,i),ol.fromBufferAttribute(t,s),o.setScalar(0),o.addScaledVector(sl,r.x),o.addScaledVector(rl,r.y),o.addScaledVector(ol,r.z),o}static isFrontFacing(t,e,i,s){return Cn.subVectors(i,e),ei.subVectors(t,e),Cn.cross(ei).dot(s)<0}set(t,e,i){return this.a.copy(t),this.b.copy(e),this.c.copy(i),this}setFromPointsAndIndices(t,e,i,s){return this.a.copy(t[e]),this.b.copy(t[i]),this.c.copy(t[s]),this}setFromAttributeAndIndices(t,e,i,s){return this.a.fromBufferAttribute(t,e),this.b.fromBufferAttribute(t,i),this.c.fromBufferAttribute(t,s),this}clone(){return new this.constructor().copy(this)}copy(t){return this.a.copy(t.a),this.b.copy(t.b),this.c.copy(t.c),this}getArea(){return Cn.subVectors(this.c,this.b),ei.subVectors(this.a,this.b),Cn.cross(ei).length()*.5}getMidpoint(t){return t.addVectors(this.a,this.b).add(this.c).multiplyScalar(1/3)}getNormal(t){return Ln.getNormal(this.a,this.b,this.c,t)}getPlane(t){return t.setFromCoplanarPoints(this.a,this.b,this.c)}getBarycoord(t,e){return Ln.getBarycoord(t,this.a,this.b,this.c,e)}getInterpolation(t,e,i,s,r){return Ln.getInterpolation(t,this.a,this.b,this.c,e,i,s,r)}containsPoint(t){return Ln.containsPoint(t,this.a,this.b,this.c)}isFrontFacing(t){return Ln.isFrontFacing(this.a,this.b,this.c,t)}intersectsBox(t){return t.intersectsTriangle(this)}closestPointToPoint(t,e){const i=this.a,s=this.b,r=this.c;let o,a;gs.subVectors(s,i),vs.subVectors(r,i),el.subVectors(t,i);const l=gs.dot(el),c=vs.dot(el);if(l<=0&&c<=0)return e.copy(i);nl.subVectors(t,s);const h=gs.dot(nl),d=vs.dot(nl);if(h>=0&&d<=h)return e.copy(s);const u=l*d-h*c;if(u<=0&&l>=0&&h<=0&&l-h>0)return o=l/(l-h),e.copy(i).addScaledVector(gs,o);il.subVectors(t,r);const p=gs.dot(il),g=vs.dot(il);if(g>=0&&p<=g)return e.copy(r);const x=p*c-l*g;if(x<=0&&c>=0&&g<=0)return a=c/(c-g),e.copy(i).addScaledVector(vs,a);const m=h*g-p*d;if(m<=0&&d-h>=0&&p-g>=0)return Pu.subVectors(r,s),a=(d-h)/(d-h+(p-g)),e.copy(s).addScaledVector(Pu,a);const f=1/(m+x+u);return o=x*f,a=u*f,e.copy(i).addScaledVector(gs,o).addScaledVector(vs,a)}equals(t){return t.a.equals(this.a)&&t.b.equals(this.b)&&t.c.equals(this.c)}}class Xr{constructor(t=new C(1/0,1/0,1/0),e=new C(-1/0,-1/0,-1/0)){this.isBox3=!0,this.min=t,this.max=e}set(t,e){return this.min.copy(t),this.max.copy(e),this}setFromArray(t){this.makeEmpty();for(let e=0,i=t.length;e<i;e+=3)this.expandByPoint(Rn.fromArray(t,e));return this}setFromBufferAttribute(t){this.makeEmpty();for(let e=0,i=t.count;e<i;e++)this.expandByPoint(Rn.fromBufferAttribute(t,e));return this}setFromPoints(t){this.makeEmpty();for(let e=0,i=t.length;e<i;e++)this.expandByPoint(t[e]);return this}setFromCenterAndSize(t,e){const i=Rn.copy(e).multiplyScalar(.5);return this.min.copy(t).sub(i),this.max.copy(t).add(i),this}setFromObject(t,e=!1){return this.makeEmpty(),this.expandByObject(t,e)}clone(){return new this.constructor().copy(this)}copy(t){return this.min.copy(t.min),this.max.copy(t.max),this}makeEmpty(){return this.min.x=this.min.y=this.min.z=1/0,this.max.x=this.max.y=this.max.z=-1/0,this}isEmpty(){return this.max.x<this.min.x||this.max.y<this.min.y||this.max.z<this.min.z}getCenter(t){return this.isEmpty()?t.set(0,0,0):t.addVectors(this.min,this.max).multiplyScalar(.5)}getSize(t){return this.isEmpty()?t.set(0,0,0):t.subVectors(this.max,this.min)}expandByPoint(t){return this.min.min(t),this.max.max(t),this}expandByVector(t){return this.min.sub(t),this.max.add(t),this}expandByScalar(t){return this.min.addScalar(-t),this.max.addScalar(t),this}expandByObject(t,e=!1){t.updateWorldMatrix(!1,!1);const i=t.geometry;if(i!==void 0){const r=i.getAttribute("position");if(e===!0&&r!==void 0&&t.isInstancedMesh!==!0&&t.isBatchedMesh!==!0)for(let o=0,a=r.count;o<a;o++)t.isMesh===!0?t.getVertexPosition(o,Rn):Rn.fromBufferAttribute(r,o),Rn.applyMatrix4(t.matrixWorld),this.expandByPoint(Rn);else t.boundingBox!==void 0?(t.boundingBox===null&&t.computeBoundingBox(),mo.copy(t.boundingBox)):(i.boundingBox===null&&i.computeBoundingBox(),mo.copy(i.boundingBox)),mo.applyMatrix4(t.matrixWorld),this.union(mo)}const s=t.children;for(let r=0,o=s.length;r<o;r++)this.expandByObject(s[r],e);return this}containsPoint(t){return t.x>=this.min.x&&t.x<=this.max.x&&t.y>=this.min.y&&t.y<=this.max.y&&t.z>=this.min.z&&t.z<=this.max.z}containsBox(t){return this.min.x<=t.min.x&&t.max.x<=this.max.x&&this.min.y<=t.min.y&&t.max.y<=this.max.y&&this.min.z<=t.min.z&&t.max.z<=this.max.z}getParameter(t,e){return e.set((t.x-this.min.x)/(this.max.x-this.min.x),(t.y-this.min.y)/(this.max.y-this.min.y),(t.z-this.min.z)/(this.max.z-this.min.z))}intersectsBox(t){return t.max.x>=this.min.x&&t.min.x<=this.max.x&&t.max.y>=this.min.y&&t.min.y<=this.max.y&&t.max.z>=this.min.z&&t.min.z<=this.max.z}intersectsSphere(t){return this.clampPoint(t.center,Rn),Rn.distanceToSquared(t.center)<=t.radius*t.radius}intersectsPlane(t){let e,i;return t.normal.x>0?(e=t.normal.x*this.min.x,i=t.normal.x*this.max.x):(e=t.normal.x*this.max.x,i=t.normal.x*this.min.x),t.normal.y>0?(e+=t.normal.y*this.min.y,i+=t.normal.y*this.max.y):(e+=t.normal.y*this.max.y,i+=t.normal.y*this.min.y),t.normal.z>0?(e+=t.normal.z*this.min.z,i+=t.normal.z*this.max.z):(e+=t.normal.z*this.max.z,i+=t.normal.z*this.min.z),e<=-t.constant&&i>=-t.constant}intersectsTriangle(t){if(this.isEmpty())return!1;this.getCenter(ar),go.subVectors(this.max,ar),_s.subVectors(t.a,ar),xs.subVectors(t.b,ar),bs.subVectors(t.c,ar),Ei.subVectors(xs,_s),Mi.subVectors(bs,xs),$i.subVectors(_s,bs);let e=[0,-Ei.z,Ei.y,0,-Mi.z,Mi.y,0,-$i.z,$i.y,Ei.z,0,-Ei.x,Mi.z,0,-Mi.x,$i.z,0,-$i.x,-Ei.y,Ei.x,0,-Mi.y,Mi.x,0,-$i.y,$i.x,0];return!al(e,_s,xs,bs,go)||(e=[1,0,0,0,1,0,0,0,1],!al(e,_s,xs,bs,go))?!1:(vo.crossVectors(Ei,Mi),e=[vo.x,vo.y,vo.z],al(e,_s,xs,bs,go))}clampPoint(t,e){return e.copy(t).clamp(this.min,this.max)}distanceToPoint(t){return this.clampPoint(t,Rn).distanceTo(t)}getBoundingSphere(t){return this.isEmpty()?t.makeEmpty():(this.getCenter(t.center),t.radius=this.getSize(Rn).length()*.5),t}intersect(t){return this.min.max(t.min),this.max.min(t.max),this.isEmpty()&&this.makeEmpty(),this}union(t){return this.min.min(t.min),this.max.max(t.max),this}applyMatrix4(t){return this.isEmpty()?this:(ii[0].set(this.min.x,this.min.y,this.min.z).applyMatrix4(t),ii[1].set(this.min.x,this.min.y,this.max.z).applyMatrix4(t),ii[2].set(this.min.x,this.max.y,this.min.z).applyMatrix4(t),ii[3].set(this.min.x,this.max.y,this.max.z).applyMatrix4(t),ii[4].set(this.max.x,this.min.y,this.min.z).applyMatrix4(t),ii[5].set(this.max.x,this.min.y,this.max.z).applyMatrix4(t),ii[6].set(this.max.x,this.max.y,this.min.z).applyMatrix4(t),ii[7].set(this.max.x,this.max.y,this.max.z).applyMatrix4(t),this.setFromPoints(ii),this)}translate(t){return this.min.add(t),this.max.add(t),this}equals(t){return t.min.equals(this.min)&&t.max.equals(this.max)}toJSON(){return{min:this.min.toArray(),max:this.max.toArray()}}fromJSON(t){return this.min.fromArray(t.min),this.max.fromArray(t.max),this}}const ii=[new C,new C,new C,new C,new C,new C,new C,new C],Rn=new C,mo=new Xr,_s=new C,xs=new C,bs=new C,Ei=new C,Mi=new C,$i=new C,ar=new C,go=new C,vo=new C,Yi=new C;function al(n,t,e,i,s){for(let r=0,o=n.length-3;r<=o;r+=3){Yi.fromArray(n,r);const a=s.x*Math.abs(Yi.x)+s.y*Math.abs(Yi.y)+s.z*Math.abs(Yi.z),l=t.dot(Yi),c=e.dot(Yi),h=i.dot(Yi);if(Math.max(-Math.max(l,c,h),Math.min(l,c,h))>a)return!1}return!0}const Ae=new C,_o=new It;let Ev=0;class un extends Gi{constructor(t,e,i=!1){if(super(),Array.isArray(t))throw new TypeError("THREE.BufferAttribute: array should be a Typed Array.");this.isBufferAttribute=!0,Object.defineProperty(this,"id",{value:Ev++}),this.name="",this.array=t,this.itemSize=e,this.count=t!==void 0?t.length/e:0,this.normalized=i,this.usage=X0,this.updateRanges=[],this.gpuType=Nn,this.version=0,this._normalizationScale=t!==void 0?Jc(t):void 0}onUploadCallback(){}set needsUpdate(t){t===!0&&this.version++}setUsage(t){return this.usage=t,this}addUpdateRange(t,e){this.updateRanges.push({start:t,count:e})}clearUpdateRanges(){this.updateRanges.length=0}copy(t){return this.name=t.name,this.array=new t.array.constructor(t.array),this.itemSize=t.itemSize,this.count=t.count,this.normalized=t.normalized,this.usage=t.usage,this.gpuType=t.gpuType,this._normalizationScale=t._normalizationScale,this}copyAt(t,e,i){t*=this.itemSize,i*=e.itemSize;for(let s=0,r=this.itemSize;s<r;s++)this.array[t+s]=e.array[i+s];return this}copyArray(t){return this.array.set(t),this}applyMatrix3(t){if(this.itemSize===2)for(let e=0,i=this.count;e<i;e++)_o.fromBufferAttribute(this,e),_o.applyMatrix3(t),this.setXY(e,_o.x,_o.y);else if(this.itemSize===3)for(let e=0,i=this.count;e<i;e++)Ae.fromBufferAttribute(this,e),Ae.applyMatrix3(t),this.setXYZ(e,Ae.x,Ae.y,Ae.z);return this}applyMatrix4(t){for(let e=0,i=this.count;e<i;e++)Ae.fromBufferAttribute(this,e),Ae.applyMatrix4(t),this.setXYZ(e,Ae.x,Ae.y,Ae.z);return this}applyNormalMatrix(t){for(let e=0,i=this.count;e<i;e++)Ae.fromBufferAttribute(this,e),Ae.applyNormalMatrix(t),this.setXYZ(e,Ae.x,Ae.y,Ae.z);return this}transformDirection(t){for(let e=0,i=this.count;e<i;e++)Ae.fromBufferAttribute(this,e),Ae.transformDirection(t),this.setXYZ(e,Ae.x,Ae.y,Ae.z);return this}set(t,e=0){return this.array.set(t,e),this}getComponent(t,e){let i=this.array[t*this.itemSize+e];return this.normalized&&(i=this._denormalize(i)),i}setComponent(t,e,i){return this.normalized&&(i=this._normalize(i)),this.array[t*this.itemSize+e]=i,this}getX(t){let e=this.array[t*this.itemSize];return this.normalized&&(e=this._denormalize(e)),e}setX(t,e){return this.normalized&&(e=this._normalize(e)),this.array[t*this.itemSize]=e,this}getY(t){let e=this.array[t*this.itemSize+1];return this.normalized&&(e=this._denormalize(e)),e}setY(t,e){return this.normalized&&(e=this._normalize(e)),this.array[t*this.itemSize+1]=e,this}getZ(t){let e=this.array[t*this.itemSize+2];return this.normalized&&(e=this._denormalize(e)),e}setZ(t,e){return this.normalized&&(e=this._normalize(e)),this.array[t*this.itemSize+2]=e,this}getW(t){let e=this.array[t*this.itemSize+3];return this.normalized&&(e=this._denormalize(e)),e}setW(t,e){return this.normalized&&(e=this._normalize(e)),this.array[t*this.itemSize+3]=e,this}setXY(t,e,i){return t*=this.itemSize,this.normalized&&(e=this._normalize(e),i=this._normalize(i)),this.array[t+0]=e,this.array[t+1]=i,this}setXYZ(t,e,i,s){return t*=this.itemSize,this.normalized&&(e=this._normalize(e),i=this._normalize(i),s=this._normalize(s)),this.array[t+0]=e,this.array[t+1]=i,this.array[t+2]=s,this}setXYZW(t,e,i,s,r){return t*=this.itemSize,this.normalized&&(e=this._normalize(e),i=this._normalize(i),s=this._normalize(s),r=this._normalize(r)),this.array[t+0]=e,this.array[t+1]=i,this.array[t+2]=s,this.array[t+3]=r,this}onUpload(t){return this.onUploadCallback=t,this}clone(){return new this.constructor(this.array,this.itemSize).copy(this)}toJSON(){const t={itemSize:this.itemSize,type:this.array.constructor.name,array:Array.from(this.array),normalized:this.normalized};return t.name=this.name,t.usage=this.usage,t.gpuType=this.gpuType,t}dispose(){this.dispatchEvent({type:"dispose"})}_denormalize(t){const e=this._normalizationScale;return e!==void 0?Math.max(t/e,-1):pf(t,this.array)}_normalize(t){const e=this._normalizationScale;return e!==void 0?Math.round(t*e):ff(t,this.array)}}class vf extends un{constructor(t,e,i){super(new Uint16Array(t),e,i)}}class _f extends un{constructor(t,e,i){super(new Uint32Array(t),e,i)}}class me extends un{constructor(t,e,i){super(new Float32Array(t),e,i)}}const Mv=new Xr,lr=new C,ll=new C;class qr{constructor(t=new C,e=-1){this.isSphere=!0,this.center=t,this.radius=e}set(t,e){return this.center.copy(t),this.radius=e,this}setFromPoints(t,e){const i=this.center;e!==void 0?i.copy(e):Mv.setFromPoints(t).getCenter(i);let s=0;for(let r=0,o=t.length;r<o;r++)s=Math.max(s,i.distanceToSquared(t[r]));return this.radius=Math.sqrt(s),this}copy(t){return this.center.copy(t.center),this.radius=t.radius,this}isEmpty(){return this.radius<0}makeEmpty(){return this.center.set(0,0,0),this.radius=-1,this}containsPoint(t){return t.distanceToSquared(this.center)<=this.radius*this.radius}distanceToPoint(t){return t.distanceTo(this.center)-this.radius}intersectsSphere(t){const e=this.radius+t.radius;return t.center.distanceToSquared(this.center)<=e*e}intersectsBox(t){return t.intersectsSphere(this)}intersectsPlane(t){return Math.abs(t.distanceToPoint(this.center))<=this.radius}clampPoint(t,e){const i=this.center.distanceToSquared(t);return e.copy(t),i>this.radius*this.radius&&(e.sub(this.center).normalize(),e.multiplyScalar(this.radius).add(this.center)),e}getBoundingBox(t){return this.isEmpty()?(t.makeEmpty(),t):(t.set(this.center,this.center),t.expandByScalar(this.radius),t)}applyMatrix4(t){return this.center.applyMatrix4(t),this.radius=this.radius*t.getMaxScaleOnAxis(),this}translate(t){return this.center.add(t),this}expandByPoint(t){if(this.isEmpty())return this.center.copy(t),this.radius=0,this;lr.subVectors(t,this.center);const e=lr.lengthSq();if(e>this.radius*this.radius){const i=Math.sqrt(e),s=(i-this.radius)*.5;this.center.addScaledVector(lr,s/i),this.radius+=s}return this}union(t){return t.isEmpty()?this:this.isEmpty()?(this.copy(t),this):(this.center.equals(t.center)===!0?this.radius=Math.max(this.radius,t.radius):(ll.subVectors(t.center,this.center).setLength(t.radius),this.expandByPoint(lr.copy(t.center).add(ll)),this.expandByPoint(lr.copy(t.center).sub(ll))),this)}equals(t){return t.center.equals(this.center)&&t.radius===this.radius}clone(){return new this.constructor().copy(this)}toJSON(){return{radius:this.radius,center:this.center.toArray()}}fromJSON(t){return this.radius=t.radius,this.center.fromArray(t.center),this}}let Tv=0;const xn=new Yt,cl=new Ne,ws=new C,hn=new Xr,cr=new Xr,ze=new C;class Ve extends Gi{constructor(){super(),this.isBufferGeometry=!0,Object.defineProperty(this,"id",{value:Tv++}),this.uuid=Ks(),this.name="",this.type="BufferGeometry",this.index=null,this.indirect=null,this.indirectOffset=0,this.attributes={},this.morphAttributes={},this.morphTargetsRelative=!1,this.groups=[],this.boundingBox=null,this.boundingSphere=null,this.drawRange={start:0,count:1/0},this.userData={},this._transformed=!1}getIndex(){return this.index}setIndex(t){return Array.isArray(t)?this.index=new(q0(t)?_f:vf)(t,1):this.index=t,this}setIndirect(t,e=0){return this.indirect=t,this.indirectOffset=e,this}getIndirect(){return this.indirect}getAttribute(t){return this.attributes[t]}setAttribute(t,e){return this.attributes[t]=e,this}deleteAttribute(t){return delete this.attributes[t],this}hasAttribute(t){return this.attributes[t]!==void 0}addGroup(t,e,i=0){this.groups.push({start:t,count:e,materialIndex:i})}clearGroups(){this.groups=[]}setDrawRange(t,e){this.drawRange.start=t,this.drawRange.count=e}applyMatrix4(t){const e=this.attributes.position;e!==void 0&&(e.applyMatrix4(t),e.needsUpdate=!0);const i=this.attributes.normal;if(i!==void 0){const r=new Lt().getNormalMatrix(t);i.applyNormalMatrix(r),i.needsUpdate=!0}const s=this.attributes.tangent;return s!==void 0&&(s.transformDirection(t),s.needsUpdate=!0),this.boundingBox!==null&&this.computeBoundingBox(),this.boundingSphere!==null&&this.computeBoundingSphere(),this._transformed=!0,this}applyQuaternion(t){return xn.makeRotationFromQuaternion(t),this.applyMatrix4(xn),this}rotateX(t){return xn.makeRotationX(t),this.applyMatrix4(xn),this}rotateY(t){return xn.makeRotationY(t),this.applyMatrix4(xn),this}rotateZ(t){return xn.makeRotationZ(t),this.applyMatrix4(xn),this}translate(t,e,i){return xn.makeTranslation(t,e,i),this.applyMatrix4(xn),this}scale(t,e,i){return xn.makeScale(t,e,i),this.applyMatrix4(xn),this}lookAt(t){return cl.lookAt(t),cl.updateMatrix(),this.applyMatrix4(cl.matrix),this}center(){return this.computeBoundingBox(),this.boundingBox.getCenter(ws).negate(),this.translate(ws.x,ws.y,ws.z),this}setFromPoints(t){const e=this.getAttribute("position");if(e===void 0){const i=[];for(let s=0,r=t.length;s<r;s++){const o=t[s];i.push(o.x,o.y,o.z||0)}this.setAttribute("position",new me(i,3))}else{const i=Math.min(t.length,e.count);for(let s=0;s<i;s++){const r=t[s];e.setXYZ(s,r.x,r.y,r.z||0)}t.length>e.count&&Dt("BufferGeometry: Buffer size too small for points data. Use .dispose() and create a new geometry."),e.needsUpdate=!0}return this}computeBoundingBox(){this.boundingBox===null&&(this.boundingBox=new Xr);const t=this.attributes.position,e=this.morphAttributes.position;if(t&&t.isGLBufferAttribute){Qt("BufferGeometry.computeBoundingBox(): GLBufferAttribute requires a manual bounding box.",this),this.boundingBox.set(new C(-1/0,-1/0,-1/0),new C(1/0,1/0,1/0));return}if(t!==void 0){if(this.boundingBox.setFromBufferAttribute(t),e)for(let i=0,s=e.length;i<s;i++){const r=e[i];hn.setFromBufferAttribute(r),this.morphTargetsRelative?(ze.addVectors(this.boundingBox.min,hn.min),this.boundingBox.expandByPoint(ze),ze.addVectors(this.boundingBox.max,hn.max),this.boundingBox.expandByPoint(ze)):(this.boundingBox.expandByPoint(hn.min),this.boundingBox.expandByPoint(hn.max))}}else this.boundingBox.makeEmpty();(isNaN(this.boundingBox.min.x)||isNaN(this.boundingBox.min.y)||isNaN(this.boundingBox.min.z))&&Qt('BufferGeometry.computeBoundingBox(): Computed min/max have NaN values. The "position" attribute is likely to have NaN values.',this)}computeBoundingSphere(){this.boundingSphere===null&&(this.boundingSphere=new qr);const t=this.attributes.position,e=this.morphAttributes.position;if(t&&t.isGLBufferAttribute){Qt("BufferGeometry.computeBoundingSphere(): GLBufferAttribute requires a manual bounding sphere.",this),this.boundingSphere.set(new C,1/0);return}if(t){const i=this.boundingSphere.center;if(hn.setFromBufferAttribute(t),e)for(let r=0,o=e.length;r<o;r++){const a=e[r];cr.setFromBufferAttribute(a),this.morphTargetsRelative?(ze.addVectors(hn.min,cr.min),hn.expandByPoint(ze),ze.addVectors(hn.max,cr.max),hn.expandByPoint(ze)):(hn.expandByPoint(cr.min),hn.expandByPoint(cr.max))}hn.getCenter(i);let s=0;for(let r=0,o=t.count;r<o;r++)ze.fromBufferAttribute(t,r),s=Math.max(s,i.distanceToSquared(ze));if(e)for(let r=0,o=e.length;r<o;r++){const a=e[r],l=this.morphTargetsRelative;for(let c=0,h=a.count;c<h;c++)ze.fromBufferAttribute(a,c),l&&(ws.fromBufferAttribute(t,c),ze.add(ws)),s=Math.max(s,i.distanceToSquared(ze))}this.boundingSphere.radius=Math.sqrt(s),isNaN(this.boundingSphere.radius)&&Qt('BufferGeometry.computeBoundingSphere(): Computed radius is NaN. The "position" attribute is likely to have NaN values.',this)}}computeTangents(){const t=this.index,e=this.attributes;if(t===null||e.position===void 0||e.normal===void 0||e.uv===void 0){Qt("BufferGeometry: .computeTangents() failed. Missing required attributes (index, position, normal or uv)");return}const i=e.position,s=e.normal,r=e.uv;let o=this.getAttribute("tangent");(o===void 0||o.count!==i.count)&&(o=new un(new Float32Array(4*i.count),4),this.setAttribute("tangent",o));const a=[],l=[],c=new Uint8Array(i.count);for(let N=0;N<i.count;N++)a[N]=new C,l[N]=new C;const h=new C,d=new C,u=new C,p=new It,g=new It,x=new It,m=new C,f=new C;function _(N,P,U){c[N]=c[P]=c[U]=1,h.fromBufferAttribute(i,N),d.fromBufferAttribute(i,P),u.fromBufferAttribute(i,U),p.fromBufferAttribute(r,N),g.fromBufferAttribute(r,P),x.fromBufferAttribute(r,U),d.sub(h),u.sub(h),g.sub(p),x.sub(p);const D=1/(g.x*x.y-x.x*g.y);isFinite(D)&&(m.copy(d).multiplyScalar(x.y).addScaledVector(u,-g.y).multiplyScalar(D),f.copy(u).multiplyScalar(g.x).addScaledVector(d,-x.x).multiplyScalar(D),a[N].add(m),a[P].add(m),a[U].add(m),l[N].add(f),l[P].add(f),l[U].add(f))}let M=this.groups;M.length===0&&(M=[{start:0,count:t.count}]);for(let N=0,P=M.length;N<P;++N){const U=M[N],D=U.start,F=U.count;for(let L=D,z=D+F;L<z;L+=3)_(t.getX(L+0),t.getX(L+1),t.getX(L+2))}const b=new C,E=new C,T=new C,v=new C;function S(N){T.fromBufferAttribute(s,N),v.copy(T);const P=a[N];b.copy(P),b.sub(T.multiplyScalar(T.dot(P))).normalize(),E.crossVectors(v,P);const D=E.dot(l[N])<0?-1:1;o.setXYZW(N,b.x,b.y,b.z,D)}for(let N=0,P=i.count;N<P;++N)c[N]&&S(N);this._transformed=!0}computeVertexNormals(){const t=this.index,e=this.getAttribute("position");if(e!==void 0){let i=this.getAttribute("normal");if(i===void 0||i.count!==e.count)i=new un(new Float32Array(e.count*3),3),this.setAttribute("normal",i);else for(let u=0,p=i.count;u<p;u++)i.setXYZ(u,0,0,0);const s=new C,r=new C,o=new C,a=new C,l=new C,c=new C,h=new C,d=new C;if(t)for(let u=0,p=t.count;u<p;u+=3){const g=t.getX(u+0),x=t.getX(u+1),m=t.getX(u+2);s.fromBufferAttribute(e,g),r.fromBufferAttribute(e,x),o.fromBufferAttribute(e,m),h.subVectors(o,r),d.subVectors(s,r),h.cross(d),a.fromBufferAttribute(i,g),l.fromBufferAttribute(i,x),c.fromBufferAttribute(i,m),a.add(h),l.add(h),c.add(h),i.setXYZ(g,a.x,a.y,a.z),i.setXYZ(x,l.x,l.y,l.z),i.setXYZ(m,c.x,c.y,c.z)}else for(let u=0,p=e.count;u<p;u+=3)s.fromBufferAttribute(e,u+0),r.fromBufferAttribute(e,u+1),o.fromBufferAttribute(e,u+2),h.subVectors(o,r),d.subVectors(s,r),h.cross(d),i.setXYZ(u+0,h.x,h.y,h.z),i.setXYZ(u+1,h.x,h.y,h.z),i.setXYZ(u+2,h.x,h.y,h.z);this.normalizeNormals(),i.needsUpdate=!0}}normalizeNormals(){const t=this.attributes.normal;for(let e=0,i=t.count;e<i;e++)ze.fromBufferAttribute(t,e),ze.normalize(),t.setXYZ(e,ze.x,ze.y,ze.z)}toNonIndexed(){function t(a,l){const c=a.array,h=a.itemSize,d=a.normalized,u=new c.constructor(l.length*h);let p=0,g=0;for(let x=0,m=l.length;x<m;x++){a.isInterleavedBufferAttribute?p=l[x]*a.data.stride+a.offset:p=l[x]*h;for(let f=0;f<h;f++)u[g++]=c[p++]}return new un(u,h,d)}if(this.index===null)return Dt("BufferGeometry.toNonIndexed(): BufferGeometry is already non-indexed."),this;const e=new Ve,i=this.index.array,s=this.attributes;for(const a in s){const l=s[a],c=t(l,i);e.setAttribute(a,c)}const r=this.morphAttributes;for(const a in r){const l=[],c=r[a];for(let h=0,d=c.length;h<d;h++){const u=c[h],p=t(u,i);l.push(p)}e.morphAttributes[a]=l}e.morphTargetsRelative=this.morphTargetsRelative;const o=this.groups;for(let a=0,l=o.length;a<l;a++){const c=o[a];e.addGroup(c.start,c.count,c.materialIndex)}return e}toJSON(){const t={metadata:{version:4.7,type:"BufferGeometry",generator:"BufferGeometry.toJSON"}};if(t.uuid=this.uuid,t.type=this.parameters!==void 0&&this._transformed===!0?"BufferGeometry":this.type,t.name=this.name,Object.keys(this.userData).length>0&&(t.userData=this.userData),this.parameters!==void 0&&this._transformed!==!0){const l=this.parameters;for(const c in l)l[c]!==void 0&&(t[c]=l[c]);return t}t.data={attributes:{}};const e=this.index;e!==null&&(t.data.index={type:e.array.constructor.name,array:Array.prototype.slice.call(e.array)});const i=this.attributes;for(const l in i){const c=i[l];t.data.attributes[l]=c.toJSON(t.data)}const s={};let r=!1;for(const l in this.morphAttributes){const c=this.morphAttributes[l],h=[];for(let d=0,u=c.length;d<u;d++){const p=c[d];h.push(p.toJSON(t.data))}h.length>0&&(s[l]=h,r=!0)}r&&(t.data.morphAttributes=s,t.data.morphTargetsRelative=this.morphTargetsRelative);const o=this.groups;o.length>0&&(t.data.groups=JSON.parse(JSON.stringify(o)));const a=this.boundingSphere;return a!==null&&(t.data.boundingSphere=a.toJSON()),t}clone(){return new this.constructor().copy(this)}copy(t){this.index=null,this.attributes={},this.morphAttributes={},this.groups=[],this.boundingBox=null,this.boundingSphere=null;const e={};this.name=t.name;const i=t.index;i!==null&&this.setIndex(i.clone());const s=t.attributes;for(const c in s){const h=s[c];this.setAttribute(c,h.clone(e))}const r=t.morphAttributes;for(const c in r){const h=[],d=r[c];for(let u=0,p=d.length;u<p;u++)h.push(d[u].clone(e));this.morphAttributes[c]=h}this.morphTargetsRelative=t.morphTargetsRelative;const o=t.groups;for(let c=0,h=o.length;c<h;c++){const d=o[c];this.addGroup(d.start,d.count,d.materialIndex)}const a=t.boundingBox;a!==null&&(this.boundingBox=a.clone());const l=t.boundingSphere;return l!==null&&(this.boundingSphere=l.clone()),this.drawRange.start=t.drawRange.start,this.drawRange.count=t.drawRange.count,this.userData=t.userData,this._transformed=t._transformed,this}dispose(){this.dispatchEvent({type:"dispose"})}}const hl=new C,Av=new C,Cv=new Lt;class Vn{constructor(t=new C(1,0,0),e=0){this.isPlane=!0,this.normal=t,this.constant=e}set(t,e){return this.normal.copy(t),this.constant=e,this}setComponents(t,e,i,s){return this.normal.set(t,e,i),this.constant=s,this}setFromNormalAndCoplanarPoint(t,e){return this.normal.copy(t),this.constant=-e.dot(this.normal),this}setFromCoplanarPoints(t,e,i){const s=hl.subVectors(i,e).cross(Av.subVectors(t,e)).normalize();return this.setFromNormalAndCoplanarPoint(s,t),this}copy(t){return this.normal.copy(t.normal),this.constant=t.constant,this}normalize(){const t=1/this.normal.length();return this.normal.multiplyScalar(t),this.constant*=t,this}negate(){return this.constant*=-1,this.normal.negate(),this}distanceToPoint(t){return this.normal.dot(t)+this.constant}distanceToSphere(t){return this.distanceToPoint(t.center)-t.radius}projectPoint(t,e){return e.copy(t).addScaledVector(this.normal,-this.distanceToPoint(t))}intersectLine(t,e,i=!0){const s=t.delta(hl),r=this.normal.dot(s);if(r===0)return this.distanceToPoint(t.start)===0?e.copy(t.start):null;const o=-(t.start.dot(this.normal)+this.constant)/r;return i===!0&&(o<0||o>1)?null:e.copy(t.start).addScaledVector(s,o)}intersectsLine(t){const e=this.distanceToPoint(t.start),i=this.distanceToPoint(t.end);return e<0&&i>0||i<0&&e>0}intersectsBox(t){return t.intersectsPlane(this)}intersectsSphere(t){return t.intersectsPlane(this)}coplanarPoint(t){return t.copy(this.normal).multiplyScalar(-this.constant)}applyMatrix4(t,e){const i=e||Cv.getNormalMatrix(t),s=this.coplanarPoint(hl).applyMatrix4(t),r=this.normal.applyMatrix3(i).normalize();return this.constant=-s.dot(r),this}translate(t){return this.constant-=t.dot(this.normal),this}equals(t){return t.normal.equals(this.normal)&&t.constant===this.constant}clone(){return new this.constructor().copy(this)}toJSON(){return{normal:this.normal.toArray(),constant:this.constant}}fromJSON(t){return this.normal.fromArray(t.normal),this.constant=t.constant,this}}let Rv=0;class Zs extends Gi{constructor(){super(),this.isMaterial=!0,Object.defineProperty(this,"id",{value:Rv++}),this.uuid=Ks(),this.name="",this.type="Material",this.blending=Tr,this.side=ns,this.vertexColors=!1,this.opacity=1,this.transparent=!1,this.alphaHash=!1,this.blendSrc=Gp,this.blendDst=Wp,this.blendEquation=Rs,this.blendSrcAlpha=null,this.blendDstAlpha=null,this.blendEquationAlpha=null,this.blendColor=new Zt(0,0,0),this.blendAlpha=0,this.depthFunc=Pr,this.depthTest=!0,this.depthWrite=!0,this.stencilWriteMask=255,this.stencilFunc=B0,this.stencilRef=0,this.stencilFuncMask=255,this.stencilFail=qa,this.stencilZFail=qa,this.stencilZPass=qa,this.stencilWrite=!1,this.clippingPlanes=null,this.clipIntersection=!1,this.clipShadows=!1,this.shadowSide=null,this.colorWrite=!0,this.precision=null,this.polygonOffset=!1,this.polygonOffsetFactor=0,this.polygonOffsetUnits=0,this.dithering=!1,this.alphaToCoverage=!1,this.premultipliedAlpha=!1,this.forceSinglePass=!1,this.allowOverride=!0,this.visible=!0,this.toneMapped=!0,this.userData={},this.version=0,this._alphaTest=0}get alphaTest(){return this._alphaTest}set alphaTest(t){this._alphaTest>0!=t>0&&this.version++,this._alphaTest=t}onBeforeRender(){}onBeforeCompile(){}customProgramCacheKey(){return this.onBeforeCompile.toString()}setValues(t){if(t!==void 0)for(const e in t){const i=t[e];if(i===void 0){Dt(`Material: parameter '${e}' has value of undefined.`);continue}const s=this[e];if(s===void 0){Dt(`Material: '${e}' is not a property of THREE.${this.type}.`);continue}s&&s.isColor?s.set(i):s&&s.isVector2&&i&&i.isVector2||s&&s.isEuler&&i&&i.isEuler||s&&s.isVector3&&i&&i.isVector3?s.copy(i):this[e]=i}}toJSON(t){const e=t===void 0||typeof t=="string";e&&(t={textures:{},images:{}});const i={metadata:{version:4.7,type:"Material",generator:"Material.toJSON"}};i.uuid=this.uuid,i.type=this.type,i.blending=this.blending,i.side=this.side,i.shadowSide=this.shadowSide,i.vertexColors=this.vertexColors,i.opacity=this.opacity,i.transparent=this.transparent,i.blendSrc=this.blendSrc,i.blendDst=this.blendDst,i.blendEquation=this.blendEquation,i.blendSrcAlpha=this.blendSrcAlpha,i.blendDstAlpha=this.blendDstAlpha,i.blendEquationAlpha=this.blendEquationAlpha,i.blendColor=this.blendColor.getHex(),i.blendAlpha=this.blendAlpha,i.depthFunc=this.depthFunc,i.depthTest=this.depthTest,i.depthWrite=this.depthWrite,i.colorWrite=this.colorWrite,i.clipIntersection=this.clipIntersection,i.clipShadows=this.clipShadows,i.stencilWriteMask=this.stencilWriteMask,i.stencilFunc=this.stencilFunc,i.stencilRef=this.stencilRef,i.stencilFuncMask=this.stencilFuncMask,i.stencilFail=this.stencilFail,i.stencilZFail=this.stencilZFail,i.stencilZPass=this.stencilZPass,i.stencilWrite=this.stencilWrite,i.polygonOffset=this.polygonOffset,i.polygonOffsetFactor=this.polygonOffsetFactor,i.polygonOffsetUnits=this.polygonOffsetUnits,i.dithering=this.dithering,i.alphaTest=this.alphaTest,i.alphaHash=this.alphaHash,i.alphaToCoverage=this.alphaToCoverage,i.premultipliedAlpha=this.premultipliedAlpha,i.forceSinglePass=this.forceSinglePass,i.allowOverride=this.allowOverride,i.visible=this.visible,i.toneMapped=this.toneMapped,i.name=this.name,this.color&&this.color.isColor&&(i.color=this.color.getHex()),this.roughness!==void 0&&(i.roughness=this.roughness),this.metalness!==void 0&&(i.metalness=this.metalness),this.sheen!==void 0&&(i.sheen=this.sheen),this.sheenColor&&this.sheenColor.isColor&&(i.sheenColor=this.sheenColor.getHex()),this.sheenRoughness!==void 0&&(i.sheenRoughness=this.sheenRoughness),this.emissive&&this.emissive.isColor&&(i.emissive=this.emissive.getHex()),this.emissiveIntensity!==void 0&&(i.emissiveIntensity=this.emissiveIntensity),this.specular&&this.specular.isColor&&(i.specular=this.specular.getHex()),this.specularIntensity!==void 0&&(i.specularIntensity=this.specularIntensity),this.specularColor&&this.specularColor.isColor&&(i.specularColor=this.specularColor.getHex()),this.shininess!==void 0&&(i.shininess=this.shininess),this.clearcoat!==void 0&&(i.clearcoat=this.clearcoat),this.clearcoatRoughness!==void 0&&(i.clearcoatRoughness=this.clearcoatRoughness),this.diffuseRoughness!==void 0&&(i.diffuseRoughness=this.diffuseRoughness),this.diffuseRoughnessMap&&this.diffuseRoughnessMap.isTexture&&(i.diffuseRoughnessMap=this.diffuseRoughnessMap.toJSON(t).uuid),this.clearcoatMap&&this.clearcoatMap.isTexture&&(i.clearcoatMap=this.clearcoatMap.toJSON(t).uuid),this.clearcoatRoughnessMap&&this.clearcoatRoughnessMap.isTexture&&(i.clearcoatRoughnessMap=this.clearcoatRoughnessMap.toJSON(t).uuid),this.clearcoatNormalMap&&this.clearcoatNormalMap.isTexture&&(i.clearcoatNormalMap=this.clearcoatNormalMap.toJSON(t).uuid,i.clearcoatNormalScale=this.clearcoatNormalScale.toArray()),this.sheenColorMap&&this.sheenColorMap.isTexture&&(i.sheenColorMap=this.sheenColorMap.toJSON(t).uuid),this.sheenRoughnessMap&&this.sheenRoughnessMap.isTexture&&(i.sheenRoughnessMap=this.sheenRoughnessMap.toJSON(t).uuid),this.dispersion!==void 0&&(i.dispersion=this.dispersion),this.retroreflectivity!==void 0&&(i.retroreflectivity=this.retroreflectivity),this.iridescence!==void 0&&(i.iridescence=this.iridescence),this.iridescenceIOR!==void 0&&(i.iridescenceIOR=this.iridescenceIOR),this.iridescenceThicknessMinimum!==void 0&&(i.iridescenceThicknessMinimum=this.iridescenceThicknessMinimum),this.iridescenceThicknessMaximum!==void 0&&(i.iridescenceThicknessMaximum=this.iridescenceThicknessMaximum),this.iridescenceMap&&this.iridescenceMap.isTexture&&(i.iridescenceMap=this.iridescenceMap.toJSON(t).uuid),this.iridescenceThicknessMap&&this.iridescenceThicknessMap.isTexture&&(i.iridescenceThicknessMap=this.iridescenceThicknessMap.toJSON(t).uuid),this.anisotropy!==void 0&&(i.anisotropy=this.anisotropy),this.anisotropyRotation!==void 0&&(i.anisotropyRotation=this.anisotropyRotation),this.anisotropyMap&&this.anisotropyMap.isTexture&&(i.anisotropyMap=this.anisotropyMap.toJSON(t).uuid),this.map&&this.map.isTexture&&(i.map=this.map.toJSON(t).uuid),this.matcap&&this.matcap.isTexture&&(i.matcap=this.matcap.toJSON(t).uuid),this.alphaMap&&this.alphaMap.isTexture&&(i.alphaMap=this.alphaMap.toJSON(t).uuid),this.lightMap&&this.lightMap.isTexture&&(i.lightMap=this.lightMap.toJSON(t).uuid,i.lightMapIntensity=this.lightMapIntensity),this.aoMap&&this.aoMap.isTexture&&(i.aoMap=this.aoMap.toJSON(t).uuid,i.aoMapIntensity=this.aoMapIntensity),this.bumpMap&&this.bumpMap.isTexture&&(i.bumpMap=this.bumpMap.toJSON(t).uuid,i.bumpScale=this.bumpScale),this.normalMap&&this.normalMap.isTexture&&(i.normalMap=this.normalMap.toJSON(t).uuid,i.normalMapType=this.normalMapType,i.normalScale=this.normalScale.toArray()),this.displacementMap&&this.displacementMap.isTexture&&(i.displacementMap=this.displacementMap.toJSON(t).uuid,i.displacementScale=this.displacementScale,i.displacementBias=this.displacementBias),this.roughnessMap&&this.roughnessMap.isTexture&&(i.roughnessMap=this.roughnessMap.toJSON(t).uuid),this.metalnessMap&&this.metalnessMap.isTexture&&(i.metalnessMap=this.metalnessMap.toJSON(t).uuid),this.emissiveMap&&this.emissiveMap.isTexture&&(i.emissiveMap=this.emissiveMap.toJSON(t).uuid),this.specularMap&&this.specularMap.isTexture&&(i.specularMap=this.specularMap.toJSON(t).uuid),this.specularIntensityMap&&this.specularIntensityMap.isTexture&&(i.specularIntensityMap=this.specularIntensityMap.toJSON(t).uuid),this.specularColorMap&&this.specularColorMap.isTexture&&(i.specularColorMap=this.specularColorMap.toJSON(t).uuid),this.envMap&&this.envMap.isTexture&&(i.envMap=this.envMap.toJSON(t).uuid,this.combine!==void 0&&(i.combine=this.combine)),this.envMapRotation!==void 0&&(i.envMapRotation=this.envMapRotation.toArray()),this.envMapIntensity!==void 0&&(i.envMapIntensity=this.envMapIntensity),this.reflectivity!==void 0&&(i.reflectivity=this.reflectivity),this.refractionRatio!==void 0&&(i.refractionRatio=this.refractionRatio),this.gradientMap&&this.gradientMap.isTexture&&(i.gradientMap=this.gradientMap.toJSON(t).uuid),this.transmission!==void 0&&(i.transmission=this.transmission),this.transmissionMap&&this.transmissionMap.isTexture&&(i.transmissionMap=this.transmissionMap.toJSON(t).uuid),this.thickness!==void 0&&(i.thickness=this.thickness),this.thicknessMap&&this.thicknessMap.isTexture&&(i.thicknessMap=this.thicknessMap.toJSON(t).uuid),this.attenuationDistance!==void 0&&(i.attenuationDistance=this.attenuationDistance),this.attenuationColor!==void 0&&(i.attenuationColor=this.attenuationColor.getHex()),this.size!==void 0&&(i.size=this.size),this.sizeAttenuation!==void 0&&(i.sizeAttenuation=this.sizeAttenuation),Array.isArray(this.clippingPlanes)&&this.clippingPlanes.length>0&&(i.clippingPlanes=this.clippingPlanes.map(r=>r.toJSON())),this.rotation!==void 0&&(i.rotation=this.rotation),this.depthPacking!==void 0&&(i.depthPacking=this.depthPacking),this.linewidth!==void 0&&(i.linewidth=this.linewidth),this.linecap!==void 0&&(i.linecap=this.linecap),this.linejoin!==void 0&&(i.linejoin=this.linejoin),this.dashSize!==void 0&&(i.dashSize=this.dashSize),this.gapSize!==void 0&&(i.gapSize=this.gapSize),this.scale!==void 0&&(i.scale=this.scale),this.wireframe!==void 0&&(i.wireframe=this.wireframe),this.wireframeLinewidth!==void 0&&(i.wireframeLinewidth=this.wireframeLinewidth),this.wireframeLinecap!==void 0&&(i.wireframeLinecap=this.wireframeLinecap),this.wireframeLinejoin!==void 0&&(i.wireframeLinejoin=this.wireframeLinejoin),this.flatShading!==void 0&&(i.flatShading=this.flatShading),this.fog!==void 0&&(i.fog=this.fog),Object.keys(this.userData).length>0&&(i.userData=this.userData);function s(r){const o=[];for(const a in r){const l=r[a];delete l.metadata,o.push(l)}return o}if(e){const r=s(t.textures),o=s(t.images);r.length>0&&(i.textures=r),o.length>0&&(i.images=o)}return i}fromJSON(t,e){if(t.uuid!==void 0&&(this.uuid=t.uuid),t.name!==void 0&&(this.name=t.name),t.color!==void 0&&this.color!==void 0&&this.color.setHex(t.color),t.roughness!==void 0&&(this.roughness=t.roughness),t.metalness!==void 0&&(this.metalness=t.metalness),t.sheen!==void 0&&(this.sheen=t.sheen),t.sheenColor!==void 0&&(this.sheenColor=new Zt().setHex(t.sheenColor)),t.sheenRoughness!==void 0&&(this.sheenRoughness=t.sheenRoughness),t.emissive!==void 0&&this.emissive!==void 0&&this.emissive.setHex(t.emissive),t.specular!==void 0&&this.specular!==void 0&&this.specular.setHex(t.specular),t.specularIntensity!==void 0&&(this.specularIntensity=t.specularIntensity),t.specularColor!==void 0&&this.specularColor!==void 0&&this.specularColor.setHex(t.specularColor),t.shininess!==void 0&&(this.shininess=t.shininess),t.clearcoat!==void 0&&(this.clearcoat=t.clearcoat),t.clearcoatRoughness!==void 0&&(this.clearcoatRoughness=t.clearcoatRoughness),t.diffuseRoughness!==void 0&&(this.diffuseRoughness=t.diffuseRoughness),t.dispersion!==void 0&&(this.dispersion=t.dispersion),t.retroreflectivity!==void 0&&(this.retroreflectivity=t.retroreflectivity),t.iridescence!==void 0&&(this.iridescence=t.iridescence),t.iridescenceIOR!==void 0&&(this.iridescenceIOR=t.iridescenceIOR),t.iridescenceThicknessMinimum!==void 0&&(this.iridescenceThicknessMinimum=t.iridescenceThicknessMinimum),t.iridescenceThicknessMaximum!==void 0&&(this.iridescenceThicknessMaximum=t.iridescenceThicknessMaximum),t.iridescenceThicknessRange!==void 0&&(this.iridescenceThicknessMinimum=t.iridescenceThicknessRange[0],this.iridescenceThicknessMaximum=t.iridescenceThicknessRange[1]),t.transmission!==void 0&&(this.transmission=t.transmission),t.thickness!==void 0&&(this.thickness=t.thickness),t.attenuationDistance!==void 0&&(this.attenuationDistance=t.attenuationDistance),t.attenuationColor!==void 0&&this.attenuationColor!==void 0&&this.attenuationColor.setHex(t.attenuationColor),t.anisotropy!==void 0&&(this.anisotropy=t.anisotropy),t.anisotropyRotation!==void 0&&(this.anisotropyRotation=t.anisotropyRotation),t.fog!==void 0&&(this.fog=t.fog),t.flatShading!==void 0&&(this.flatShading=t.flatShading),t.blending!==void 0&&(this.blending=t.blending),t.combine!==void 0&&(this.combine=t.combine),t.side!==void 0&&(this.side=t.side),t.shadowSide!==void 0&&(this.shadowSide=t.shadowSide),t.opacity!==void 0&&(this.opacity=t.opacity),t.transparent!==void 0&&(this.transparent=t.transparent),t.alphaTest!==void 0&&(this.alphaTest=t.alphaTest),t.alphaHash!==void 0&&(this.alphaHash=t.alphaHash),t.depthFunc!==void 0&&(this.depthFunc=t.depthFunc),t.depthTest!==void 0&&(this.depthTest=t.depthTest),t.depthWrite!==void 0&&(this.depthWrite=t.depthWrite),t.colorWrite!==void 0&&(this.colorWrite=t.colorWrite),t.clippingPlanes!==void 0&&(this.clippingPlanes=t.clippingPlanes.map(i=>new Vn().fromJSON(i))),t.clipIntersection!==void 0&&(this.clipIntersection=t.clipIntersection),t.clipShadows!==void 0&&(this.clipShadows=t.clipShadows),t.depthPacking!==void 0&&(this.depthPacking=t.depthPacking),t.blendSrc!==void 0&&(this.blendSrc=t.blendSrc),t.blendDst!==void 0&&(this.blendDst=t.blendDst),t.blendEquation!==void 0&&(this.blendEquation=t.blendEquation),t.blendSrcAlpha!==void 0&&(this.blendSrcAlpha=t.blendSrcAlpha),t.blendDstAlpha!==void 0&&(this.blendDstAlpha=t.blendDstAlpha),t.blendEquationAlpha!==void 0&&(this.blendEquationAlpha=t.blendEquationAlpha),t.blendColor!==void 0&&this.blendColor!==void 0&&this.blendColor.setHex(t.blendColor),t.blendAlpha!==void 0&&(this.blendAlpha=t.blendAlpha),t.stencilWriteMask!==void 0&&(this.stencilWriteMask=t.stencilWriteMask),t.stencilFunc!==void 0&&(this.stencilFunc=t.stencilFunc),t.stencilRef!==void 0&&(this.stencilRef=t.stencilRef),t.stencilFuncMask!==void 0&&(this.stencilFuncMask=t.stencilFuncMask),t.stencilFail!==void 0&&(this.stencilFail=t.stencilFail),t.stencilZFail!==void 0&&(this.stencilZFail=t.stencilZFail),t.stencilZPass!==void 0&&(this.stencilZPass=t.stencilZPass),t.stencilWrite!==void 0&&(this.stencilWrite=t.stencilWrite),t.wireframe!==void 0&&(this.wireframe=t.wireframe),t.wireframeLinewidth!==void 0&&(this.wireframeLinewidth=t.wireframeLinewidth),t.wireframeLinecap!==void 0&&(this.wireframeLinecap=t.wireframeLinecap),t.wireframeLinejoin!==void 0&&(this.wireframeLinejoin=t.wireframeLinejoin),t.rotation!==void 0&&(this.rotation=t.rotation),t.linewidth!==void 0&&(this.linewidth=t.linewidth),t.linecap!==void 0&&(this.linecap=t.linecap),t.linejoin!==void 0&&(this.linejoin=t.linejoin),t.dashSize!==void 0&&(this.dashSize=t.dashSize),t.gapSize!==void 0&&(this.gapSize=t.gapSize),t.scale!==void 0&&(this.scale=t.scale),t.polygonOffset!==void 0&&(this.polygonOffset=t.polygonOffset),t.polygonOffsetFactor!==void 0&&(this.polygonOffsetFactor=t.polygonOffsetFactor),t.polygonOffsetUnits!==void 0&&(this.polygonOffsetUnits=t.polygonOffsetUnits),t.dithering!==void 0&&(this.dithering=t.dithering),t.alphaToCoverage!==void 0&&(this.alphaToCoverage=t.alphaToCoverage),t.premultipliedAlpha!==void 0&&(this.premultipliedAlpha=t.premultipliedAlpha),t.forceSinglePass!==void 0&&(this.forceSinglePass=t.forceSinglePass),t.allowOverride!==void 0&&(this.allowOverride=t.allowOverride),t.visible!==void 0&&(this.visible=t.visible),t.toneMapped!==void 0&&(this.toneMapped=t.toneMapped),t.userData!==void 0&&(this.userData=t.userData),t.vertexColors!==void 0&&(typeof t.vertexColors=="number"?this.vertexColors=t.vertexColors>0:this.vertexColors=t.vertexColors),t.size!==void 0&&(this.size=t.size),t.sizeAttenuation!==void 0&&(this.sizeAttenuation=t.sizeAttenuation),t.map!==void 0&&(this.map=e[t.map]||null),t.matcap!==void 0&&(this.matcap=e[t.matcap]||null),t.alphaMap!==void 0&&(this.alphaMap=e[t.alphaMap]||null),t.bumpMap!==void 0&&(this.bumpMap=e[t.bumpMap]||null),t.bumpScale!==void 0&&(this.bumpScale=t.bumpScale),t.normalMap!==void 0&&(this.normalMap=e[t.normalMap]||null),t.normalMapType!==void 0&&(this.normalMapType=t.normalMapType),t.normalScale!==void 0){let i=t.normalScale;Array.isArray(i)===!1&&(i=[i,i]),this.normalScale=new It().fromArray(i)}return t.displacementMap!==void 0&&(this.displacementMap=e[t.displacementMap]||null),t.displacementScale!==void 0&&(this.displacementScale=t.displacementScale),t.displacementBias!==void 0&&(this.displacementBias=t.displacementBias),t.roughnessMap!==void 0&&(this.roughnessMap=e[t.roughnessMap]||null),t.metalnessMap!==void 0&&(this.metalnessMap=e[t.metalnessMap]||null),t.emissiveMap!==void 0&&(this.emissiveMap=e[t.emissiveMap]||null),t.emissiveIntensity!==void 0&&(this.emissiveIntensity=t.emissiveIntensity),t.specularMap!==void 0&&(this.specularMap=e[t.specularMap]||null),t.specularIntensityMap!==void 0&&(this.specularIntensityMap=e[t.specularIntensityMap]||null),t.specularColorMap!==void 0&&(this.specularColorMap=e[t.specularColorMap]||null),t.envMap!==void 0&&(this.envMap=e[t.envMap]||null),t.envMapRotation!==void 0&&this.envMapRotation.fromArray(t.envMapRotation),t.envMapIntensity!==void 0&&(this.envMapIntensity=t.envMapIntensity),t.reflectivity!==void 0&&(this.reflectivity=t.reflectivity),t.refractionRatio!==void 0&&(this.refractionRatio=t.refractionRatio),t.lightMap!==void 0&&(this.lightMap=e[t.lightMap]||null),t.lightMapIntensity!==void 0&&(this.lightMapIntensity=t.lightMapIntensity),t.aoMap!==void 0&&(this.aoMap=e[t.aoMap]||null),t.aoMapIntensity!==void 0&&(this.aoMapIntensity=t.aoMapIntensity),t.gradientMap!==void 0&&(this.gradientMap=e[t.gradientMap]||null),t.clearcoatMap!==void 0&&(this.clearcoatMap=e[t.clearcoatMap]||null),t.clearcoatRoughnessMap!==void 0&&(this.clearcoatRoughnessMap=e[t.clearcoatRoughnessMap]||null),t.clearcoatNormalMap!==void 0&&(this.clearcoatNormalMap=e[t.clearcoatNormalMap]||null),t.clearcoatNormalScale!==void 0&&(this.clearcoatNormalScale=new It().fromArray(t.clearcoatNormalScale)),t.diffuseRoughnessMap!==void 0&&(this.diffuseRoughnessMap=e[t.diffuseRoughnessMap]||null),t.iridescenceMap!==void 0&&(this.iridescenceMap=e[t.iridescenceMap]||null),t.iridescenceThicknessMap!==void 0&&(this.iridescenceThicknessMap=e[t.iridescenceThicknessMap]||null),t.transmissionMap!==void 0&&(this.transmissionMap=e[t.transmissionMap]||null),t.thicknessMap!==void 0&&(this.thicknessMap=e[t.thicknessMap]||null),t.anisotropyMap!==void 0&&(this.anisotropyMap=e[t.anisotropyMap]||null),t.sheenColorMap!==void 0&&(this.sheenColorMap=e[t.sheenColorMap]||null),t.sheenRoughnessMap!==void 0&&(this.sheenRoughnessMap=e[t.sheenRoughnessMap]||null),this}clone(){return new this.constructor().copy(this)}copy(t){this.name=t.name,this.blending=t.blending,this.side=t.side,this.vertexColors=t.vertexColors,this.opacity=t.opacity,this.transparent=t.transparent,this.blendSrc=t.blendSrc,this.blendDst=t.blendDst,this.blendEquation=t.blendEquation,this.blendSrcAlpha=t.blendSrcAlpha,this.blendDstAlpha=t.blendDstAlpha,this.blendEquationAlpha=t.blendEquationAlpha,this.blendColor.copy(t.blendColor),this.blendAlpha=t.blendAlpha,this.depthFunc=t.depthFunc,this.depthTest=t.depthTest,this.depthWrite=t.depthWrite,this.stencilWriteMask=t.stencilWriteMask,this.stencilFunc=t.stencilFunc,this.stencilRef=t.stencilRef,this.stencilFuncMask=t.stencilFuncMask,this.stencilFail=t.stencilFail,this.stencilZFail=t.stencilZFail,this.stencilZPass=t.stencilZPass,this.stencilWrite=t.stencilWrite;const e=t.clippingPlanes;let i=null;if(e!==null){const s=e.length;i=new Array(s);for(let r=0;r!==s;++r)i[r]=e[r].clone()}return this.clippingPlanes=i,this.clipIntersection=t.clipIntersection,this.clipShadows=t.clipShadows,this.shadowSide=t.shadowSide,this.colorWrite=t.colorWrite,this.precision=t.precision,this.polygonOffset=t.polygonOffset,this.polygonOffsetFactor=t.polygonOffsetFactor,this.polygonOffsetUnits=t.polygonOffsetUnits,this.dithering=t.dithering,this.alphaTest=t.alphaTest,this.alphaHash=t.alphaHash,this.alphaToCoverage=t.alphaToCoverage,this.premultipliedAlpha=t.premultipliedAlpha,this.forceSinglePass=t.forceSinglePass,this.allowOverride=t.allowOverride,this.visible=t.visible,this.toneMapped=t.toneMapped,this.userData=JSON.parse(JSON.stringify(t.userData)),this}dispose(){this.dispatchEvent({type:"dispose"})}set needsUpdate(t){t===!0&&this.version++}}const si=new C,ul=new C,xo=new C,bo=new C;class js{constructor(t=new C,e=new C(0,0,-1)){this.origin=t,this.direction=e}set(t,e){return this.origin.copy(t),this.direction.copy(e),this}copy(t){return this.origin.copy(t.origin),this.direction.copy(t.direction),this}at(t,e){return e.copy(this.origin).addScaledVector(this.direction,t)}lookAt(t){return this.direction.copy(t).sub(this.origin).normalize(),this}recast(t){return this.origin.copy(this.at(t,si)),this}closestPointToPoint(t,e){e.subVectors(t,this.origin);const i=e.dot(this.direction);return i<0?e.copy(this.origin):e.copy(this.origin).addScaledVector(this.direction,i)}distanceToPoint(t){return Math.sqrt(this.distanceSqToPoint(t))}distanceSqToPoint(t){const e=si.subVectors(t,this.origin).dot(this.direction);return e<0?this.origin.distanceToSquared(t):(si.copy(this.origin).addScaledVector(this.direction,e),si.distanceToSquared(t))}distanceSqToSegment(t,e,i,s){ul.copy(t).add(e).multiplyScalar(.5),xo.copy(e).sub(t).normalize(),bo.copy(this.origin).sub(ul);const r=t.distanceTo(e)*.5,o=-this.direction.dot(xo),a=bo.dot(this.direction),l=-bo.dot(xo),c=bo.lengthSq(),h=Math.abs(1-o*o);let d,u,p,g;if(h>0)if(d=o*l-a,u=o*a-l,g=r*h,d>=0)if(u>=-g)if(u<=g){const x=1/h;d*=x,u*=x,p=d*(d+o*u+2*a)+u*(o*d+u+2*l)+c}else u=r,d=Math.max(0,-(o*u+a)),p=-d*d+u*(u+2*l)+c;else u=-r,d=Math.max(0,-(o*u+a)),p=-d*d+u*(u+2*l)+c;else u<=-g?(d=Math.max(0,-(-o*r+a)),u=d>0?-r:Math.min(Math.max(-r,-l),r),p=-d*d+u*(u+2*l)+c):u<=g?(d=0,u=Math.min(Math.max(-r,-l),r),p=u*(u+2*l)+c):(d=Math.max(0,-(o*r+a)),u=d>0?r:Math.min(Math.max(-r,-l),r),p=-d*d+u*(u+2*l)+c);else u=o>0?-r:r,d=Math.max(0,-(o*u+a)),p=-d*d+u*(u+2*l)+c;return i&&i.copy(this.origin).addScaledVector(this.direction,d),s&&s.copy(ul).addScaledVector(xo,u),p}intersectSphere(t,e){if(t.radius<0)return null;si.subVectors(t.center,this.origin);const i=si.dot(this.direction),s=si.dot(si)-i*i,r=t.radius*t.radius;if(s>r)return null;const o=Math.sqrt(r-s),a=i-o,l=i+o;return l<0?null:a<0?this.at(l,e):this.at(a,e)}intersectsSphere(t){return t.radius<0?!1:this.distanceSqToPoint(t.center)<=t.radius*t.radius}distanceToPlane(t){const e=t.normal.dot(this.direction);if(e===0)return t.distanceToPoint(this.origin)===0?0:null;const i=-(this.origin.dot(t.normal)+t.constant)/e;return i>=0?i:null}intersectPlane(t,e){const i=this.distanceToPlane(t);return i===null?null:this.at(i,e)}intersectsPlane(t){const e=t.distanceToPoint(this.origin);return e===0||t.normal.dot(this.direction)*e<0}intersectBox(t,e){let i,s,r,o,a,l;const c=1/this.direction.x,h=1/this.direction.y,d=1/this.direction.z,u=this.origin;return c>=0?(i=(t.min.x-u.x)*c,s=(t.max.x-u.x)*c):(i=(t.max.x-u.x)*c,s=(t.min.x-u.x)*c),h>=0?(r=(t.min.y-u.y)*h,o=(t.max.y-u.y)*h):(r=(t.max.y-u.y)*h,o=(t.min.y-u.y)*h),i>o||r>s||((r>i||isNaN(i))&&(i=r),(o<s||isNaN(s))&&(s=o),d>=0?(a=(t.min.z-u.z)*d,l=(t.max.z-u.z)*d):(a=(t.max.z-u.z)*d,l=(t.min.z-u.z)*d),i>l||a>s)||((a>i||i!==i)&&(i=a),(l<s||s!==s)&&(s=l),s<0)?null:this.at(i>=0?i:s,e)}intersectsBox(t){return this.intersectBox(t,si)!==null}intersectTriangle(t,e,i,s,r){const o=this.origin,a=this.direction,l=a.x,c=a.y,h=a.z,d=t.x-o.x,u=t.y-o.y,p=t.z-o.z,g=e.x-o.x,x=e.y-o.y,m=e.z-o.z,f=i.x-o.x,_=i.y-o.y,M=i.z-o.z,b=Math.abs(l),E=Math.abs(c),T=Math.abs(h);let v,S,N,P,U,D,F,L,z,$,k,tt;if(b>=E&&b>=T?(N=l,D=d,z=g,tt=f,l>=0?(v=c,S=h,P=u,U=p,F=x,L=m,$=_,k=M):(v=h,S=c,P=p,U=u,F=m,L=x,$=M,k=_)):E>=T?(N=c,D=u,z=x,tt=_,c>=0?(v=h,S=l,P=p,U=d,F=m,L=g,$=M,k=f):(v=l,S=h,P=d,U=p,F=g,L=m,$=f,k=M)):(N=h,D=p,z=m,tt=M,h>=0?(v=l,S=c,P=d,U=u,F=g,L=x,$=f,k=_):(v=c,S=l,P=u,U=d,F=x,L=g,$=_,k=f)),N===0)return null;const W=v/N,Q=S/N,et=1/N,xt=P-W*D,Nt=U-Q*D,K=F-W*z,mt=L-Q*z,wt=$-W*tt,Ct=k-Q*tt,gt=wt*mt-Ct*K,Ft=xt*Ct-Nt*wt,Me=K*Nt-mt*xt;if(s){if(gt<0||Ft<0||Me<0)return null}else if((gt<0||Ft<0||Me<0)&&(gt>0||Ft>0||Me>0))return null;const Pt=gt+Ft+Me;if(Pt===0)return null;const ie=et*(gt*D+Ft*z+Me*tt);return(Pt>0?ie<0:ie>0)?null:this.at(ie/Pt,r)}applyMatrix4(t){return this.origin.applyMatrix4(t),this.direction.transformDirection(t),this}equals(t){return t.origin.equals(this.origin)&&t.direction.equals(this.direction)}clone(){return new this.constructor().copy(this)}}class ih extends Zs{constructor(t){super(),this.isMeshBasicMaterial=!0,this.type="MeshBasicMaterial",this.color=new Zt(16777215),this.map=null,this.lightMap=null,this.lightMapIntensity=1,this.aoMap=null,this.aoMapIntensity=1,this.specularMap=null,this.alphaMap=null,this.envMap=null,this.envMapRotation=new Kn,this.combine=Xp,this.reflectivity=1,this.refractionRatio=.98,this.wireframe=!1,this.wireframeLinewidth=1,this.wireframeLinecap="round",this.wireframeLinejoin="round",this.fog=!0,this.setValues(t)}copy(t){return super.copy(t),this.color.copy(t.color),this.map=t.map,this.lightMap=t.lightMap,this.lightMapIntensity=t.lightMapIntensity,this.aoMap=t.aoMap,this.aoMapIntensity=t.aoMapIntensity,this.specularMap=t.specularMap,this.alphaMap=t.alphaMap,this.envMap=t.envMap,this.envMapRotation.copy(t.envMapRotation),this.combine=t.combine,this.reflectivity=t.reflectivity,this.refractionRatio=t.refractionRatio,this.wireframe=t.wireframe,this.wireframeLinewidth=t.wireframeLinewidth,this.wireframeLinecap=t.wireframeLinecap,this.wireframeLinejoin=t.wireframeLinejoin,this.fog=t.fog,this}}const Lu=new Yt,Ki=new js,wo=new qr,Du=new C,yo=new C,So=new C,Eo=new C,dl=new C,Mo=new C,Iu=new C,To=new C;class _t extends Ne{constructor(t=new Ve,e=new ih){super(),this.isMesh=!0,this.type="Mesh",this.geometry=t,this.material=e,this.morphTargetDictionary=void 0,this.morphTargetInfluences=void 0,this.count=1,this.updateMorphTargets()}copy(t,e){return super.copy(t,e),t.morphTargetInfluences!==void 0?this.morphTargetInfluences=t.morphTargetInfluences.slice():this.morphTargetInfluences=void 0,t.morphTargetDictionary!==void 0?this.morphTargetDictionary=Object.assign({},t.morphTargetDictionary):this.morphTargetDictionary=void 0,this.material=Array.isArray(t.material)?t.material.slice():t.material,this.geometry=t.geometry,this}updateMorphTargets(){const e=this.geometry.morphAttributes,i=Object.keys(e);if(i.length>0){const s=e[i[0]];if(s!==void 0){this.morphTargetInfluences=[],this.morphTargetDictionary={};for(let r=0,o=s.length;r<o;r++){const a=s[r].name||String(r);this.morphTargetInfluences.push(0),this.morphTargetDictionary[a]=r}}}}getVertexPosition(t,e){const i=this.geometry,s=i.attributes.position,r=i.morphAttributes.position,o=i.morphTargetsRelative;e.fromBufferAttribute(s,t);const a=this.morphTargetInfluences;if(r&&a){Mo.set(0,0,0);for(let l=0,c=r.length;l<c;l++){const h=a[l],d=r[l];h!==0&&(dl.fromBufferAttribute(d,t),o?Mo.addScaledVector(dl,h):Mo.addScaledVector(dl.sub(e),h))}e.add(Mo)}return e}intersectsFrustum(t){return t.intersectsObject(this)}raycast(t,e){const i=this.geometry,s=this.material,r=this.matrixWorld;s!==void 0&&(i.boundingSphere===null&&i.computeBoundingSphere(),wo.copy(i.boundingSphere),wo.applyMatrix4(r),Ki.copy(t.ray).recast(t.near),!(wo.containsPoint(Ki.origin)===!1&&(Ki.intersectSphere(wo,Du)===null||Ki.origin.distanceToSquared(Du)>(t.far-t.near)**2))&&(Lu.copy(r).invert(),Ki.copy(t.ray).applyMatrix4(Lu),!(i.boundingBox!==null&&Ki.intersectsBox(i.boundingBox)===!1)&&this._computeIntersections(t,e,Ki)))}_computeIntersections(t,e,i){let s;const r=this.geometry,o=this.material,a=r.index,l=r.attributes.position,c=r.attributes.uv,h=r.attributes.uv1,d=r.attributes.normal,u=r.groups,p=r.drawRange;if(a!==null)if(Array.isArray(o))for(let g=0,x=u.length;g<x;g++){const m=u[g],f=o[m.materialIndex],_=Math.max(m.start,p.start),M=Math.min(a.count,Math.min(m.start+m.count,p.start+p.count));for(let b=_,E=M;b<E;b+=3){const T=a.getX(b),v=a.getX(b+1),S=a.getX(b+2);s=Ao(this,f,t,i,c,h,d,T,v,S),s&&(s.faceIndex=Math.floor(b/3),s.face.materialIndex=m.materialIndex,e.push(s))}}else{const g=Math.max(0,p.start),x=Math.min(a.count,p.start+p.count);for(let m=g,f=x;m<f;m+=3){const _=a.getX(m),M=a.getX(m+1),b=a.getX(m+2);s=Ao(this,o,t,i,c,h,d,_,M,b),s&&(s.faceIndex=Math.floor(m/3),e.push(s))}}else if(l!==void 0)if(Array.isArray(o))for(let g=0,x=u.length;g<x;g++){const m=u[g],f=o[m.materialIndex],_=Math.max(m.start,p.start),M=Math.min(l.count,Math.min(m.start+m.count,p.start+p.count));for(let b=_,E=M;b<E;b+=3){const T=b,v=b+1,S=b+2;s=Ao(this,f,t,i,c,h,d,T,v,S),s&&(s.faceIndex=Math.floor(b/3),s.face.materialIndex=m.materialIndex,e.push(s))}}else{const g=Math.max(0,p.start),x=Math.min(l.count,p.start+p.count);for(let m=g,f=x;m<f;m+=3){const _=m,M=m+1,b=m+2;s=Ao(this,o,t,i,c,h,d,_,M,b),s&&(s.faceIndex=Math.floor(m/3),e.push(s))}}}}function Pv(n,t,e,i,s,r,o,a){let l;if(t.side===an?l=i.intersectTriangle(o,r,s,!0,a):l=i.intersectTriangle(s,r,o,t.side===ns,a),l===null)return null;To.copy(a),To.applyMatrix4(n.matrixWorld);const c=e.ray.origin.distanceTo(To);return c<e.near||c>e.far?null:{distance:c,point:To.clone(),object:n}}function Ao(n,t,e,i,s,r,o,a,l,c){n.getVertexPosition(a,yo),n.getVertexPosition(l,So),n.getVertexPosition(c,Eo);const h=Pv(n,t,e,i,yo,So,Eo,Iu);if(h){const d=new C;Ln.getBarycoord(Iu,yo,So,Eo,d),s&&(h.uv=Ln.getInterpolatedAttribute(s,a,l,c,d,new It)),r&&(h.uv1=Ln.getInterpolatedAttribute(r,a,l,c,d,new It)),o&&(h.normal=Ln.getInterpolatedAttribute(o,a,l,c,d,new C),h.normal.dot(i.direction)>0&&h.normal.multiplyScalar(-1));const u={a,b:l,c,normal:new C,materialIndex:0};Ln.getNormal(yo,So,Eo,u.normal),h.face=u,h.barycoord=d}return h}class xf extends je{constructor(t=null,e=1,i=1,s,r,o,a,l,c=Se,h=Se,d,u){super(null,o,a,l,c,h,s,r,d,u),this.isDataTexture=!0,this.image={data:t,width:e,height:i},this.generateMipmaps=!1,this.flipY=!1,this.unpackAlignment=1}}const Zi=new qr,Lv=new It(.5,.5),Co=new C;class da{constructor(t=new Vn,e=new Vn,i=new Vn,s=new Vn,r=new Vn,o=new Vn){this.planes=[t,e,i,s,r,o]}set(t,e,i,s,r,o){const a=this.planes;return a[0].copy(t),a[1].copy(e),a[2].copy(i),a[3].copy(s),a[4].copy(r),a[5].copy(o),this}copy(t){const e=this.planes;for(let i=0;i<6;i++)e[i].copy(t.planes[i]);return this}setFromProjectionMatrix(t,e=Un,i=!1){const s=this.planes,r=t.elements,o=r[0],a=r[1],l=r[2],c=r[3],h=r[4],d=r[5],u=r[6],p=r[7],g=r[8],x=r[9],m=r[10],f=r[11],_=r[12],M=r[13],b=r[14],E=r[15];if(s[0].setComponents(c-o,p-h,f-g,E-_).normalize(),s[1].setComponents(c+o,p+h,f+g,E+_).normalize(),s[2].setComponents(c+a,p+d,f+x,E+M).normalize(),s[3].setComponents(c-a,p-d,f-x,E-M).normalize(),i)s[4].setComponents(l,u,m,b).normalize(),s[5].setComponents(c-l,p-u,f-m,E-b).normalize();else if(s[4].setComponents(c-l,p-u,f-m,E-b).normalize(),e===Un)s[5].setComponents(c+l,p+u,f+m,E+b).normalize();else if(e===ha)s[5].setComponents(l,u,m,b).normalize();else throw new Error("THREE.Frustum.setFromProjectionMatrix(): Invalid coordinate system: "+e);return this}intersectsObject(t){if(t.boundingSphere!==void 0)t.boundingSphere===null&&t.computeBoundingSphere(),Zi.copy(t.boundingSphere).applyMatrix4(t.matrixWorld);else{const e=t.geometry;e.boundingSphere===null&&e.computeBoundingSphere(),Zi.copy(e.boundingSphere).applyMatrix4(t.matrixWorld)}return this.intersectsSphere(Zi)}intersectsSprite(t){Zi.center.set(0,0,0);const e=Lv.distanceTo(t.center);return Zi.radius=.7071067811865476+e,Zi.applyMatrix4(t.matrixWorld),this.intersectsSphere(Zi)}intersectsSphere(t){const e=this.planes,i=t.center,s=-t.radius;for(let r=0;r<6;r++)if(e[r].distanceToPoint(i)<s)return!1;return!0}intersectsBox(t){const e=this.planes;for(let i=0;i<6;i++){const s=e[i];if(Co.x=s.normal.x>0?t.max.x:t.min.x,Co.y=s.normal.y>0?t.max.y:t.min.y,Co.z=s.normal.z>0?t.max.z:t.min.z,s.distanceToPoint(Co)<0)return!1}return!0}containsPoint(t){const e=this.planes;for(let i=0;i<6;i++)if(e[i].distanceToPoint(t)<0)return!1;return!0}clone(){return new this.constructor().copy(this)}}const Nu=new Yt;class sh{constructor(){this.coordinateSystem=Un,this._frustums=[],this._count=0}setFromArrayCamera(t){const e=t.cameras,i=this._frustums;for(let s=0;s<e.length;s++){const r=e[s];Nu.multiplyMatrices(r.projectionMatrix,r.matrixWorldInverse),i[s]===void 0&&(i[s]=new da),i[s].setFromProjectionMatrix(Nu,r.coordinateSystem,r.reversedDepth)}return this._count=e.length,this}getFrustum(t){return this._frustums[t]}intersectsObject(t){const e=this._frustums;for(let i=0;i<this._count;i++)if(e[i].intersectsObject(t))return!0;return!1}intersectsSprite(t){const e=this._frustums;for(let i=0;i<this._count;i++)if(e[i].intersectsSprite(t))return!0;return!1}intersectsSphere(t){const e=this._frustums;for(let i=0;i<this._count;i++)if(e[i].intersectsSphere(t))return!0;return!1}intersectsBox(t){const e=this._frustums;for(let i=0;i<this._count;i++)if(e[i].intersectsBox(t))return!0;return!1}containsPoint(t){const e=this._frustums;for(let i=0;i<this._count;i++)if(e[i].containsPoint(t))return!0;return!1}copy(t){this.coordinateSystem=t.coordinateSystem;const e=this._frustums,i=t._frustums;for(let s=0;s<t._count;s++)e[s]===void 0&&(e[s]=new da),e[s].copy(i[s]);return this._count=t._count,this}clone(){return new sh().copy(this)}}class bf extends Zs{constructor(t){super(),this.isLineBasicMaterial=!0,this.type="LineBasicMaterial",this.color=new Zt(16777215),this.map=null,this.linewidth=1,this.linecap="round",this.linejoin="round",this.fog=!0,this.setValues(t)}copy(t){return super.copy(t),this.color.copy(t.color),this.map=t.map,this.linewidth=t.linewidth,this.linecap=t.linecap,this.linejoin=t.linejoin,this.fog=t.fog,this}}const pa=new C,fa=new C,Uu=new Yt,hr=new js,Ro=new qr,pl=new C,Ou=new C;class Ti extends Ne{constructor(t=new Ve,e=new bf){super(),this.isLine=!0,this.type="Line",this.geometry=t,this.material=e,this.morphTargetDictionary=void 0,this.morphTargetInfluences=void 0,this.updateMorphTargets()}copy(t,e){return super.copy(t,e),t.morphTargetInfluences!==void 0?this.morphTargetInfluences=t.morphTargetInfluences.slice():this.morphTargetInfluences=void 0,t.morphTargetDictionary!==void 0?this.morphTargetDictionary=Object.assign({},t.morphTargetDictionary):this.morphTargetDictionary=void 0,this.material=Array.isArray(t.material)?t.material.slice():t.material,this.geometry=t.geometry,this}computeLineDistances(){const t=this.geometry;if(t.index===null){const e=t.attributes.position,i=[0];for(let s=1,r=e.count;s<r;s++)pa.fromBufferAttribute(e,s-1),fa.fromBufferAttribute(e,s),i[s]=i[s-1],i[s]+=pa.distanceTo(fa);t.setAttribute("lineDistance",new me(i,1))}else Dt("Line.computeLineDistances(): Computation only possible with non-indexed BufferGeometry.");return this}intersectsFrustum(t){return t.intersectsObject(this)}raycast(t,e){const i=this.geometry,s=this.matrixWorld,r=t.params.Line.threshold,o=i.drawRange;if(i.boundingSphere===null&&i.computeBoundingSphere(),Ro.copy(i.boundingSphere),Ro.applyMatrix4(s),Ro.radius+=r,t.ray.intersectsSphere(Ro)===!1)return;Uu.copy(s).invert(),hr.copy(t.ray).applyMatrix4(Uu);const a=r/((this.scale.x+this.scale.y+this.scale.z)/3),l=a*a,c=this.isLineSegments?2:1,h=i.index,u=i.attributes.position;if(h!==null){const p=Math.max(0,o.start),g=Math.min(h.count,o.start+o.count);for(let x=p,m=g-1;x<m;x+=c){const f=h.getX(x),_=h.getX(x+1),M=Po(this,t,hr,l,f,_,x);M&&e.push(M)}if(this.isLineLoop){const x=h.getX(g-1),m=h.getX(p),f=Po(this,t,hr,l,x,m,g-1);f&&e.push(f)}}else{const p=Math.max(0,o.start),g=Math.min(u.count,o.start+o.count);for(let x=p,m=g-1;x<m;x+=c){const f=Po(this,t,hr,l,x,x+1,x);f&&e.push(f)}if(this.isLineLoop){const x=Po(this,t,hr,l,g-1,p,g-1);x&&e.push(x)}}}updateMorphTargets(){const e=this.geometry.morphAttributes,i=Object.keys(e);if(i.length>0){const s=e[i[0]];if(s!==void 0){this.morphTargetInfluences=[],this.morphTargetDictionary={};for(let r=0,o=s.length;r<o;r++){const a=s[r].name||String(r);this.morphTargetInfluences.push(0),this.morphTargetDictionary[a]=r}}}}}function Po(n,t,e,i,s,r,o){const a=n.geometry.attributes.position;if(pa.fromBufferAttribute(a,s),fa.fromBufferAttribute(a,r),e.distanceSqToSegment(pa,fa,pl,Ou)>i)return;pl.applyMatrix4(n.matrixWorld);const c=t.ray.origin.distanceTo(pl);if(!(c<t.near||c>t.far))return{distance:c,point:Ou.clone().applyMatrix4(n.matrixWorld),index:o,face:null,faceIndex:null,barycoord:null,object:n}}class Dv extends Zs{constructor(t){super(),this.isPointsMaterial=!0,this.type="PointsMaterial",this.color=new Zt(16777215),this.map=null,this.alphaMap=null,this.size=1,this.sizeAttenuation=!0,this.fog=!0,this.setValues(t)}copy(t){return super.copy(t),this.color.copy(t.color),this.map=t.map,this.alphaMap=t.alphaMap,this.size=t.size,this.sizeAttenuation=t.sizeAttenuation,this.fog=t.fog,this}}const Fu=new Yt,Ec=new js,Lo=new qr,Do=new C;class wf extends Ne{constructor(t=new Ve,e=new Dv){super(),this.isPoints=!0,this.type="Points",this.geometry=t,this.material=e,this.morphTargetDictionary=void 0,this.morphTargetInfluences=void 0,this.updateMorphTargets()}copy(t,e){return super.copy(t,e),t.morphTargetInfluences!==void 0?this.morphTargetInfluences=t.morphTargetInfluences.slice():this.morphTargetInfluences=void 0,t.morphTargetDictionary!==void 0?this.morphTargetDictionary=Object.assign({},t.morphTargetDictionary):this.morphTargetDictionary=void 0,this.material=Array.isArray(t.material)?t.material.slice():t.material,this.geometry=t.geometry,this}intersectsFrustum(t){return t.intersectsObject(this)}raycast(t,e){const i=this.geometry,s=this.matrixWorld,r=t.params.Points.threshold,o=i.drawRange;if(i.boundingSphere===null&&i.computeBoundingSphere(),Lo.copy(i.boundingSphere),Lo.applyMatrix4(s),Lo.radius+=r,t.ray.intersectsSphere(Lo)===!1)return;Fu.copy(s).invert(),Ec.copy(t.ray).applyMatrix4(Fu);const a=r/((this.scale.x+this.scale.y+this.scale.z)/3),l=a*a,c=i.index,d=i.attributes.position;if(c!==null){const u=Math.max(0,o.start),p=Math.min(c.count,o.start+o.count);for(let g=u,x=p;g<x;g++){const m=c.getX(g);Do.fromBufferAttribute(d,m),ku(Do,m,l,s,t,e,this)}}else{const u=Math.max(0,o.start),p=Math.min(d.count,o.start+o.count);for(let g=u,x=p;g<x;g++)Do.fromBufferAttribute(d,g),ku(Do,g,l,s,t,e,this)}}updateMorphTargets(){const e=this.geometry.morphAttributes,i=Object.keys(e);if(i.length>0){const s=e[i[0]];if(s!==void 0){this.morphTargetInfluences=[],this.morphTargetDictionary={};for(let r=0,o=s.length;r<o;r++){const a=s[r].name||String(r);this.morphTargetInfluences.push(0),this.morphTargetDictionary[a]=r}}}}}function ku(n,t,e,i,s,r,o){const a=Ec.distanceSqToPoint(n);if(a<e){const l=new C;Ec.closestPointToPoint(n,l),l.applyMatrix4(i);const c=s.ray.origin.distanceTo(l);if(c<s.near||c>s.far)return;r.push({distance:c,distanceToRay:Math.sqrt(a),point:l,index:t,face:null,faceIndex:null,barycoord:null,object:o})}}class yf extends je{constructor(t=[],e=Gs,i,s,r,o,a,l,c,h){super(t,e,i,s,r,o,a,l,c,h),this.isCubeTexture=!0,this.flipY=!1}get images(){return this.image}set images(t){this.image=t}}class Xs extends je{constructor(t,e,i=$n,s,r,o,a=Se,l=Se,c,h=Bi,d=1){if(h!==Bi&&h!==Ui)throw new Error("THREE.DepthTexture: format must be either THREE.DepthFormat or THREE.DepthStencilFormat");const u={width:t,height:e,depth:d};super(u,s,r,o,a,l,h,i,c),this.isDepthTexture=!0,this.flipY=!1,this.generateMipmaps=!1,this.compareFunction=null}copy(t){return super.copy(t),this.source=new th(Object.assign({},t.image)),this.compareFunction=t.compareFunction,this}toJSON(t){const e=super.toJSON(t);return e.compareFunction=this.compareFunction,e}}class Sf extends Xs{constructor(t,e=$n,i=Gs,s,r,o=Se,a=Se,l,c=Bi){const h={width:t,height:t,depth:1},d=[h,h,h,h,h,h];super(t,t,e,i,s,r,o,a,l,c),this.image=d,this.isCubeDepthTexture=!0,this.isCubeTexture=!0}get images(){return this.image}set images(t){this.image=t}}class Ef extends je{constructor(t=null){super(),this.sourceTexture=t,this.isExternalTexture=!0}copy(t){return super.copy(t),this.sourceTexture=t.sourceTexture,this}}class Ce extends Ve{constructor(t=1,e=1,i=1,s=1,r=1,o=1){super(),this.type="BoxGeometry",this.parameters={width:t,height:e,depth:i,widthSegments:s,heightSegments:r,depthSegments:o};const a=this;s=Math.floor(s),r=Math.floor(r),o=Math.floor(o);const l=[],c=[],h=[],d=[];let u=0,p=0;g("z","y","x",-1,-1,i,e,t,o,r,0),g("z","y","x",1,-1,i,e,-t,o,r,1),g("x","z","y",1,1,t,i,e,s,o,2),g("x","z","y",1,-1,t,i,-e,s,o,3),g("x","y","z",1,-1,t,e,i,s,r,4),g("x","y","z",-1,-1,t,e,-i,s,r,5),this.setIndex(l),this.setAttribute("position",new me(c,3)),this.setAttribute("normal",new me(h,3)),this.setAttribute("uv",new me(d,2));function g(x,m,f,_,M,b,E,T,v,S,N){const P=b/v,U=E/S,D=b/2,F=E/2,L=T/2,z=v+1,$=S+1;let k=0,tt=0;const W=new C;for(let Q=0;Q<$;Q++){const et=Q*U-F;for(let xt=0;xt<z;xt++){const Nt=xt*P-D;W[x]=Nt*_,W[m]=et*M,W[f]=L,c.push(W.x,W.y,W.z),W[x]=0,W[m]=0,W[f]=T>0?1:-1,h.push(W.x,W.y,W.z),d.push(xt/v),d.push(1-Q/S),k+=1}}for(let Q=0;Q<S;Q++)for(let et=0;et<v;et++){const xt=u+et+z*Q,Nt=u+et+z*(Q+1),K=u+(et+1)+z*(Q+1),mt=u+(et+1)+z*Q;l.push(xt,Nt,mt),l.push(Nt,K,mt),tt+=6}a.addGroup(p,tt,N),p+=tt,u+=k}}copy(t){return super.copy(t),this.parameters=Object.assign({},t.parameters),this}static fromJSON(t){return new Ce(t.width,t.height,t.depth,t.widthSegments,t.heightSegments,t.depthSegments)}}class Ze extends Ve{constructor(t=1,e=1,i=1,s=32,r=1,o=!1,a=0,l=Math.PI*2){super(),this.type="CylinderGeometry",this.parameters={radiusTop:t,radiusBottom:e,height:i,radialSegments:s,heightSegments:r,openEnded:o,thetaStart:a,thetaLength:l};const c=this;s=Math.floor(s),r=Math.floor(r);const h=[],d=[],u=[],p=[];let g=0;const x=[],m=i/2;let f=0;_(),o===!1&&(t>0&&M(!0),e>0&&M(!1)),this.setIndex(h),this.setAttribute("position",new me(d,3)),this.setAttribute("normal",new me(u,3)),this.setAttribute("uv",new me(p,2));function _(){const b=new C,E=new C;let T=0;const v=(e-t)/i;for(let S=0;S<=r;S++){const N=[],P=S/r,U=P*(e-t)+t;for(let D=0;D<=s;D++){const F=D/s,L=F*l+a,z=Math.sin(L),$=Math.cos(L);E.x=U*z,E.y=-P*i+m,E.z=U*$,d.push(E.x,E.y,E.z),b.set(z,v,$).normalize(),u.push(b.x,b.y,b.z),p.push(F,1-P),N.push(g++)}x.push(N)}for(let S=0;S<s;S++)for(let N=0;N<r;N++){const P=x[N][S],U=x[N+1][S],D=x[N+1][S+1],F=x[N][S+1];(t>0||N!==0)&&(h.push(P,U,F),T+=3),(e>0||N!==r-1)&&(h.push(U,D,F),T+=3)}c.addGroup(f,T,0),f+=T}function M(b){const E=g,T=new It,v=new C;let S=0;const N=b===!0?t:e,P=b===!0?1:-1;for(let D=1;D<=s;D++)d.push(0,m*P,0),u.push(0,P,0),p.push(.5,.5),g++;const U=g;for(let D=0;D<=s;D++){const L=D/s*l+a,z=Math.cos(L),$=Math.sin(L);v.x=N*$,v.y=m*P,v.z=N*z,d.push(v.x,v.y,v.z),u.push(0,P,0),T.x=z*.5+.5,T.y=$*.5*P+.5,p.push(T.x,T.y),g++}for(let D=0;D<s;D++){const F=E+D,L=U+D;b===!0?h.push(L,L+1,F):h.push(L+1,L,F),S+=3}c.addGroup(f,S,b===!0?1:2),f+=S}}copy(t){return super.copy(t),this.parameters=Object.assign({},t.parameters),this}static fromJSON(t){return new Ze(t.radiusTop,t.radiusBottom,t.height,t.radialSegments,t.heightSegments,t.openEnded,t.thetaStart,t.thetaLength)}}class rh extends Ve{constructor(t=[],e=[],i=1,s=0){super(),this.type="PolyhedronGeometry",this.parameters={vertices:t,indices:e,radius:i,detail:s};const r=[],o=[];a(s),c(i),h(),this.setAttribute("position",new me(r,3)),this.setAttribute("normal",new me(r.slice(),3)),this.setAttribute("uv",new me(o,2)),s===0?this.computeVertexNormals():this.normalizeNormals();function a(_){const M=new C,b=new C,E=new C;for(let T=0;T<e.length;T+=3)p(e[T+0],M),p(e[T+1],b),p(e[T+2],E),l(M,b,E,_)}function l(_,M,b,E){const T=E+1,v=[];for(let S=0;S<=T;S++){v[S]=[];const N=_.clone().lerp(b,S/T),P=M.clone().lerp(b,S/T),U=T-S;for(let D=0;D<=U;D++)D===0&&S===T?v[S][D]=N:v[S][D]=N.clone().lerp(P,D/U)}for(let S=0;S<T;S++)for(let N=0;N<2*(T-S)-1;N++){const P=Math.floor(N/2);N%2===0?(u(v[S][P+1]),u(v[S+1][P]),u(v[S][P])):(u(v[S][P+1]),u(v[S+1][P+1]),u(v[S+1][P]))}}function c(_){const M=new C;for(let b=0;b<r.length;b+=3)M.x=r[b+0],M.y=r[b+1],M.z=r[b+2],M.normalize().multiplyScalar(_),r[b+0]=M.x,r[b+1]=M.y,r[b+2]=M.z}function h(){const _=new C;for(let M=0;M<r.length;M+=3){_.x=r[M+0],_.y=r[M+1],_.z=r[M+2];const b=m(_)/2/Math.PI+.5,E=f(_)/Math.PI+.5;o.push(b,1-E)}g(),d()}function d(){for(let _=0;_<o.length;_+=6){const M=o[_+0],b=o[_+2],E=o[_+4],T=Math.max(M,b,E),v=Math.min(M,b,E);T>.9&&v<.1&&(M<.2&&(o[_+0]+=1),b<.2&&(o[_+2]+=1),E<.2&&(o[_+4]+=1))}}function u(_){r.push(_.x,_.y,_.z)}function p(_,M){const b=_*3;M.x=t[b+0],M.y=t[b+1],M.z=t[b+2]}function g(){const _=new C,M=new C,b=new C,E=new C,T=new It,v=new It,S=new It;for(let N=0,P=0;N<r.length;N+=9,P+=6){_.set(r[N+0],r[N+1],r[N+2]),M.set(r[N+3],r[N+4],r[N+5]),b.set(r[N+6],r[N+7],r[N+8]),T.set(o[P+0],o[P+1]),v.set(o[P+2],o[P+3]),S.set(o[P+4],o[P+5]),E.copy(_).add(M).add(b).divideScalar(3);const U=m(E);x(T,P+0,_,U),x(v,P+2,M,U),x(S,P+4,b,U)}}function x(_,M,b,E){E<0&&_.x===1&&(o[M]=_.x-1),b.x===0&&b.z===0&&(o[M]=E/2/Math.PI+.5)}function m(_){return Math.atan2(_.z,-_.x)}function f(_){return Math.atan2(-_.y,Math.sqrt(_.x*_.x+_.z*_.z))}}copy(t){return super.copy(t),this.parameters=Object.assign({},t.parameters),this}static fromJSON(t){return new rh(t.vertices,t.indices,t.radius,t.detail)}}class Ls extends rh{constructor(t=1,e=0){const i=[1,0,0,-1,0,0,0,1,0,0,-1,0,0,0,1,0,0,-1],s=[0,2,4,0,4,3,0,3,5,0,5,2,1,2,5,1,5,3,1,3,4,1,4,2];super(i,s,t,e),this.type="OctahedronGeometry",this.parameters={radius:t,detail:e}}static fromJSON(t){return new Ls(t.radius,t.detail)}}class Vi extends Ve{constructor(t=1,e=1,i=1,s=1){super(),this.type="PlaneGeometry",this.parameters={width:t,height:e,widthSegments:i,heightSegments:s};const r=t/2,o=e/2,a=Math.floor(i),l=Math.floor(s),c=a+1,h=l+1,d=t/a,u=e/l,p=[],g=[],x=[],m=[];for(let f=0;f<h;f++){const _=f*u-o;for(let M=0;M<c;M++){const b=M*d-r;g.push(b,-_,0),x.push(0,0,1),m.push(M/a),m.push(1-f/l)}}for(let f=0;f<l;f++)for(let _=0;_<a;_++){const M=_+c*f,b=_+c*(f+1),E=_+1+c*(f+1),T=_+1+c*f;p.push(M,b,T),p.push(b,E,T)}this.setIndex(p),this.setAttribute("position",new me(g,3)),this.setAttribute("normal",new me(x,3)),this.setAttribute("uv",new me(m,2))}copy(t){return super.copy(t),this.parameters=Object.assign({},t.parameters),this}static fromJSON(t){return new Vi(t.width,t.height,t.widthSegments,t.heightSegments)}}class oh extends Ve{constructor(t=1,e=32,i=16,s=0,r=Math.PI*2,o=0,a=Math.PI){super(),this.type="SphereGeometry",this.parameters={radius:t,widthSegments:e,heightSegments:i,phiStart:s,phiLength:r,thetaStart:o,thetaLength:a},e=Math.max(3,Math.floor(e)),i=Math.max(2,Math.floor(i));const l=Math.min(o+a,Math.PI);let c=0;const h=[],d=new C,u=new C,p=[],g=[],x=[],m=[];for(let f=0;f<=i;f++){const _=[],M=f/i,b=o+M*a,E=t*Math.cos(b),T=Math.sqrt(t*t-E*E);let v=0;f===0&&o===0?v=.5/e:f===i&&l===Math.PI&&(v=-.5/e);for(let S=0;S<=e;S++){const N=S/e,P=s+N*r;d.x=-T*Math.cos(P),d.y=E,d.z=T*Math.sin(P),g.push(d.x,d.y,d.z),u.copy(d).normalize(),x.push(u.x,u.y,u.z),m.push(N+v,1-M),_.push(c++)}h.push(_)}for(let f=0;f<i;f++)for(let _=0;_<e;_++){const M=h[f][_+1],b=h[f][_],E=h[f+1][_],T=h[f+1][_+1];(f!==0||o>0)&&p.push(M,b,T),(f!==i-1||l<Math.PI)&&p.push(b,E,T)}this.setIndex(p),this.setAttribute("position",new me(g,3)),this.setAttribute("normal",new me(x,3)),this.setAttribute("uv",new me(m,2))}copy(t){return super.copy(t),this.parameters=Object.assign({},t.parameters),this}static fromJSON(t){return new oh(t.radius,t.widthSegments,t.heightSegments,t.phiStart,t.phiLength,t.thetaStart,t.thetaLength)}}class ts extends Ve{constructor(t=1,e=.4,i=12,s=48,r=Math.PI*2,o=0,a=Math.PI*2){super(),this.type="TorusGeometry",this.parameters={radius:t,tube:e,radialSegments:i,tubularSegments:s,arc:r,thetaStart:o,thetaLength:a},i=Math.floor(i),s=Math.floor(s);const l=[],c=[],h=[],d=[],u=new C,p=new C,g=new C;for(let x=0;x<=i;x++){const m=o+x/i*a;for(let f=0;f<=s;f++){const _=f/s*r;p.x=(t+e*Math.cos(m))*Math.cos(_),p.y=(t+e*Math.cos(m))*Math.sin(_),p.z=e*Math.sin(m),c.push(p.x,p.y,p.z),u.x=t*Math.cos(_),u.y=t*Math.sin(_),g.subVectors(p,u).normalize(),h.push(g.x,g.y,g.z),d.push(f/s),d.push(x/i)}}for(let x=1;x<=i;x++)for(let m=1;m<=s;m++){const f=(s+1)*x+m-1,_=(s+1)*(x-1)+m-1,M=(s+1)*(x-1)+m,b=(s+1)*x+m;l.push(f,_,b),l.push(_,M,b)}this.setIndex(l),this.setAttribute("position",new me(c,3)),this.setAttribute("normal",new me(h,3)),this.setAttribute("uv",new me(d,2))}copy(t){return super.copy(t),this.parameters=Object.assign({},t.parameters),this}static fromJSON(t){return new ts(t.radius,t.tube,t.radialSegments,t.tubularSegments,t.arc,t.thetaStart,t.thetaLength)}}function qs(n){const t={};for(const e in n){t[e]={};for(const i in n[e]){const s=n[e][i];if(Bu(s))s.isRenderTargetTexture?(Dt("UniformsUtils: Textures of render targets cannot be cloned via cloneUniforms() or mergeUniforms()."),t[e][i]=null):t[e][i]=s.clone();else if(Array.isArray(s))if(Bu(s[0])){const r=[];for(let o=0,a=s.length;o<a;o++)r[o]=s[o].clone();t[e][i]=r}else t[e][i]=s.slice();else t[e][i]=s}}return t}function Je(n){const t={};for(let e=0;e<n.length;e++){const i=qs(n[e]);for(const s in i)t[s]=i[s]}return t}function Bu(n){return n&&(n.isColor||n.isMatrix3||n.isMatrix4||n.isVector2||n.isVector3||n.isVector4||n.isTexture||n.isQuaternion)}function Iv(n){const t=[];for(let e=0;e<n.length;e++)t.push(n[e].clone());return t}function Mf(n){const t=n.getRenderTarget();return t===null?n.outputColorSpace:t.isXRRenderTarget===!0?t.texture.colorSpace:qt.workingColorSpace}const Nv={clone:qs,merge:Je};var Uv=`void main() {
	gl_Position = projectionMatrix * modelViewMatrix * vec4( position, 1.0 );
}`,Ov=`void main() {
	gl_FragColor = vec4( 1.0, 0.0, 0.0, 1.0 );
}`;class dn extends Zs{constructor(t){super(),this.isShaderMaterial=!0,this.type="ShaderMaterial",this.defines={},this.uniforms={},this.uniformsGroups=[],this.vertexShader=Uv,this.fragmentShader=Ov,this.linewidth=1,this.wireframe=!1,this.wireframeLinewidth=1,this.fog=!1,this.lights=!1,this.clipping=!1,this.forceSinglePass=!0,this.extensions={clipCullDistance:!1,multiDraw:!1},this.defaultAttributeValues={color:[1,1,1],uv:[0,0],uv1:[0,0]},this.index0AttributeName=void 0,this.uniformsNeedUpdate=!1,this.glslVersion=null,t!==void 0&&this.setValues(t)}copy(t){return super.copy(t),this.fragmentShader=t.fragmentShader,this.vertexShader=t.vertexShader,this.uniforms=qs(t.uniforms),this.uniformsGroups=Iv(t.uniformsGroups),this.defines=Object.assign({},t.defines),this.wireframe=t.wireframe,this.wireframeLinewidth=t.wireframeLinewidth,this.fog=t.fog,this.lights=t.lights,this.clipping=t.clipping,this.extensions=Object.assign({},t.extensions),this.glslVersion=t.glslVersion,this.defaultAttributeValues=Object.assign({},t.defaultAttributeValues),this.index0AttributeName=t.index0AttributeName,this.uniformsNeedUpdate=t.uniformsNeedUpdate,this}toJSON(t){const e=super.toJSON(t);e.glslVersion=this.glslVersion,e.uniforms={};for(const s in this.uniforms){const o=this.uniforms[s].value;o&&o.isTexture?e.uniforms[s]={type:"t",value:o.toJSON(t).uuid}:o&&o.isColor?e.uniforms[s]={type:"c",value:o.getHex()}:o&&o.isVector2?e.uniforms[s]={type:"v2",value:o.toArray()}:o&&o.isVector3?e.uniforms[s]={type:"v3",value:o.toArray()}:o&&o.isVector4?e.uniforms[s]={type:"v4",value:o.toArray()}:o&&o.isMatrix3?e.uniforms[s]={type:"m3",value:o.toArray()}:o&&o.isMatrix4?e.uniforms[s]={type:"m4",value:o.toArray()}:e.uniforms[s]={value:o}}Object.keys(this.defines).length>0&&(e.defines=this.defines),e.vertexShader=this.vertexShader,e.fragmentShader=this.fragmentShader,e.lights=this.lights,e.clipping=this.clipping;const i={};for(const s in this.extensions)this.extensions[s]===!0&&(i[s]=!0);return Object.keys(i).length>0&&(e.extensions=i),e}fromJSON(t,e){if(super.fromJSON(t,e),t.uniforms!==void 0)for(const i in t.uniforms){const s=t.uniforms[i];switch(this.uniforms[i]={},s.type){case"t":this.uniforms[i].value=e[s.value]||null;break;case"c":this.uniforms[i].value=new Zt().setHex(s.value);break;case"v2":this.uniforms[i].value=new It().fromArray(s.value);break;case"v3":this.uniforms[i].value=new C().fromArray(s.value);break;case"v4":this.uniforms[i].value=new Ee().fromArray(s.value);break;case"m3":this.uniforms[i].value=new Lt().fromArray(s.value);break;case"m4":this.uniforms[i].value=new Yt().fromArray(s.value);break;default:this.uniforms[i].value=s.value}}if(t.defines!==void 0&&(this.defines=t.defines),t.vertexShader!==void 0&&(this.vertexShader=t.vertexShader),t.fragmentShader!==void 0&&(this.fragmentShader=t.fragmentShader),t.glslVersion!==void 0&&(this.glslVersion=t.glslVersion),t.extensions!==void 0)for(const i in t.extensions)this.extensions[i]=t.extensions[i];return t.lights!==void 0&&(this.lights=t.lights),t.clipping!==void 0&&(this.clipping=t.clipping),this}}class Fv extends dn{constructor(t){super(t),this.isRawShaderMaterial=!0,this.type="RawShaderMaterial"}}class kv extends Zs{constructor(t){super(),this.isMeshDepthMaterial=!0,this.type="MeshDepthMaterial",this.depthPacking=F0,this.map=null,this.alphaMap=null,this.displacementMap=null,this.displacementScale=1,this.displacementBias=0,this.wireframe=!1,this.wireframeLinewidth=1,this.setValues(t)}copy(t){return super.copy(t),this.depthPacking=t.depthPacking,this.map=t.map,this.alphaMap=t.alphaMap,this.displacementMap=t.displacementMap,this.displacementScale=t.displacementScale,this.displacementBias=t.displacementBias,this.wireframe=t.wireframe,this.wireframeLinewidth=t.wireframeLinewidth,this}}class Bv extends Zs{constructor(t){super(),this.isMeshDistanceMaterial=!0,this.type="MeshDistanceMaterial",this.map=null,this.alphaMap=null,this.displacementMap=null,this.displacementScale=1,this.displacementBias=0,this.setValues(t)}copy(t){return super.copy(t),this.map=t.map,this.alphaMap=t.alphaMap,this.displacementMap=t.displacementMap,this.displacementScale=t.displacementScale,this.displacementBias=t.displacementBias,this}}const Io=new C,No=new ce,Fn=new C;let Tf=class extends Ne{constructor(){super(),this.isCamera=!0,this.type="Camera",this.matrixWorldInverse=new Yt,this.projectionMatrix=new Yt,this.projectionMatrixInverse=new Yt,this.coordinateSystem=Un,this._reversedDepth=!1}get reversedDepth(){return this._reversedDepth}copy(t,e){return super.copy(t,e),this.matrixWorldInverse.copy(t.matrixWorldInverse),this.projectionMatrix.copy(t.projectionMatrix),this.projectionMatrixInverse.copy(t.projectionMatrixInverse),this.coordinateSystem=t.coordinateSystem,this}getWorldDirection(t){return super.getWorldDirection(t).negate()}updateMatrixWorld(t){super.updateMatrixWorld(t),this.matrixWorld.decompose(Io,No,Fn),Fn.x===1&&Fn.y===1&&Fn.z===1?this.matrixWorldInverse.copy(this.matrixWorld).invert():this.matrixWorldInverse.compose(Io,No,Fn.set(1,1,1)).invert()}updateWorldMatrix(t,e,i=!1){super.updateWorldMatrix(t,e,i),this.matrixWorld.decompose(Io,No,Fn),Fn.x===1&&Fn.y===1&&Fn.z===1?this.matrixWorldInverse.copy(this.matrixWorld).invert():this.matrixWorldInverse.compose(Io,No,Fn.set(1,1,1)).invert()}clone(){return new this.constructor().copy(this)}};const Ai=new C,zu=new It,Vu=new It;class Pn extends Tf{constructor(t=50,e=1,i=.1,s=2e3){super(),this.isPerspectiveCamera=!0,this.type="PerspectiveCamera",this.fov=t,this.zoom=1,this.near=i,this.far=s,this.focus=10,this.aspect=e,this.view=null,this.filmGauge=35,this.filmOffset=0,this.updateProjectionMatrix()}copy(t,e){return super.copy(t,e),this.fov=t.fov,this.zoom=t.zoom,this.near=t.near,this.far=t.far,this.focus=t.focus,this.aspect=t.aspect,this.view=t.view===null?null:Object.assign({},t.view),this.filmGauge=t.filmGauge,this.filmOffset=t.filmOffset,this}setFocalLength(t){const e=.5*this.getFilmHeight()/t;this.fov=Ir*2*Math.atan(e),this.updateProjectionMatrix()}getFocalLength(){const t=Math.tan(Ar*.5*this.fov);return .5*this.getFilmHeight()/t}getEffectiveFOV(){return Ir*2*Math.atan(Math.tan(Ar*.5*this.fov)/this.zoom)}getFilmWidth(){return this.filmGauge*Math.min(this.aspect,1)}getFilmHeight(){return this.filmGauge/Math.max(this.aspect,1)}getViewBounds(t,e,i){Ai.set(-1,-1,.5).applyMatrix4(this.projectionMatrixInverse),e.set(Ai.x,Ai.y).multiplyScalar(-t/Ai.z),Ai.set(1,1,.5).applyMatrix4(this.projectionMatrixInverse),i.set(Ai.x,Ai.y).multiplyScalar(-t/Ai.z)}getViewSize(t,e){return this.getViewBounds(t,zu,Vu),e.subVectors(Vu,zu)}setViewOffset(t,e,i,s,r,o){this.aspect=t/e,this.view===null&&(this.view={enabled:!0,fullWidth:1,fullHeight:1,offsetX:0,offsetY:0,width:1,height:1}),this.view.enabled=!0,this.view.fullWidth=t,this.view.fullHeight=e,this.view.offsetX=i,this.view.offsetY=s,this.view.width=r,this.view.height=o,this.updateProjectionMatrix()}clearViewOffset(){this.view!==null&&(this.view.enabled=!1),this.updateProjectionMatrix()}updateProjectionMatrix(){const t=this.near;let e=t*Math.tan(Ar*.5*this.fov)/this.zoom,i=2*e,s=this.aspect*i,r=-.5*s;const o=this.view;if(this.view!==null&&this.view.enabled){const l=o.fullWidth,c=o.fullHeight;r+=o.offsetX*s/l,e-=o.offsetY*i/c,s*=o.width/l,i*=o.height/c}const a=this.filmOffset;a!==0&&(r+=t*a/this.getFilmWidth()),this.projectionMatrix.makePerspective(r,r+s,e,e-i,t,this.far,this.coordinateSystem,this.reversedDepth),this.projectionMatrixInverse.copy(this.projectionMatrix).invert()}toJSON(t){const e=super.toJSON(t);return e.object.fov=this.fov,e.object.zoom=this.zoom,e.object.near=this.near,e.object.far=this.far,e.object.focus=this.focus,e.object.aspect=this.aspect,this.view!==null&&(e.object.view=Object.assign({},this.view)),e.object.filmGauge=this.filmGauge,e.object.filmOffset=this.filmOffset,e}}class Af extends Tf{constructor(t=-1,e=1,i=1,s=-1,r=.1,o=2e3){super(),this.isOrthographicCamera=!0,this.type="OrthographicCamera",this.zoom=1,this.view=null,this.left=t,this.right=e,this.top=i,this.bottom=s,this.near=r,this.far=o,this.updateProjectionMatrix()}copy(t,e){return super.copy(t,e),this.left=t.left,this.right=t.right,this.top=t.top,this.bottom=t.bottom,this.near=t.near,this.far=t.far,this.zoom=t.zoom,this.view=t.view===null?null:Object.assign({},t.view),this}setViewOffset(t,e,i,s,r,o){this.view===null&&(this.view={enabled:!0,fullWidth:1,fullHeight:1,offsetX:0,offsetY:0,width:1,height:1}),this.view.enabled=!0,this.view.fullWidth=t,this.view.fullHeight=e,this.view.offsetX=i,this.view.offsetY=s,this.view.width=r,this.view.height=o,this.updateProjectionMatrix()}clearViewOffset(){this.view!==null&&(this.view.enabled=!1),this.updateProjectionMatrix()}updateProjectionMatrix(){const t=(this.right-this.left)/(2*this.zoom),e=(this.top-this.bottom)/(2*this.zoom),i=(this.right+this.left)/2,s=(this.top+this.bottom)/2;let r=i-t,o=i+t,a=s+e,l=s-e;if(this.view!==null&&this.view.enabled){const c=(this.right-this.left)/this.view.fullWidth/this.zoom,h=(this.top-this.bottom)/this.view.fullHeight/this.zoom;r+=c*this.view.offsetX,o=r+c*this.view.width,a-=h*this.view.offsetY,l=a-h*this.view.height}this.projectionMatrix.makeOrthographic(r,o,a,l,this.near,this.far,this.coordinateSystem,this.reversedDepth),this.projectionMatrixInverse.copy(this.projectionMatrix).invert()}toJSON(t){const e=super.toJSON(t);return e.object.zoom=this.zoom,e.object.left=this.left,e.object.right=this.right,e.object.top=this.top,e.object.bottom=this.bottom,e.object.near=this.near,e.object.far=this.far,this.view!==null&&(e.object.view=Object.assign({},this.view)),e}}const ys=-90,Ss=1;class Mc extends Ne{constructor(t,e,i){super(),this.type="CubeCamera",this.renderTarget=i,this.coordinateSystem=null,this.activeMipmapLevel=0;const s=new Pn(ys,Ss,t,e);s.layers=this.layers,this.add(s);const r=new Pn(ys,Ss,t,e);r.layers=this.layers,this.add(r);const o=new Pn(ys,Ss,t,e);o.layers=this.layers,this.add(o);const a=new Pn(ys,Ss,t,e);a.layers=this.layers,this.add(a);const l=new Pn(ys,Ss,t,e);l.layers=this.layers,this.add(l);const c=new Pn(ys,Ss,t,e);c.layers=this.layers,this.add(c)}updateCoordinateSystem(){const t=this.coordinateSystem,e=this.children.concat(),[i,s,r,o,a,l]=e;for(const c of e)this.remove(c);if(t===Un)i.up.set(0,1,0),i.lookAt(1,0,0),s.up.set(0,1,0),s.lookAt(-1,0,0),r.up.set(0,0,-1),r.lookAt(0,1,0),o.up.set(0,0,1),o.lookAt(0,-1,0),a.up.set(0,1,0),a.lookAt(0,0,1),l.up.set(0,1,0),l.lookAt(0,0,-1);else if(t===ha)i.up.set(0,-1,0),i.lookAt(-1,0,0),s.up.set(0,-1,0),s.lookAt(1,0,0),r.up.set(0,0,1),r.lookAt(0,1,0),o.up.set(0,0,-1),o.lookAt(0,-1,0),a.up.set(0,-1,0),a.lookAt(0,0,1),l.up.set(0,-1,0),l.lookAt(0,0,-1);else throw new Error("THREE.CubeCamera.updateCoordinateSystem(): Invalid coordinate system: "+t);for(const c of e)this.add(c),c.updateMatrixWorld()}update(t,e){this.parent===null&&this.updateMatrixWorld();const{renderTarget:i,activeMipmapLevel:s}=this;this.coordinateSystem!==t.coordinateSystem&&(this.coordinateSystem=t.coordinateSystem,this.updateCoordinateSystem());const[r,o,a,l,c,h]=this.children,d=t.getRenderTarget(),u=t.getActiveCubeFace(),p=t.getActiveMipmapLevel(),g=t.xr.enabled;t.xr.enabled=!1;const x=i.texture.mipmapsAutoUpdate;i.texture.mipmapsAutoUpdate=!1;let m=!1;t.isWebGLRenderer===!0?m=t.state.buffers.depth.getReversed():m=t.reversedDepthBuffer,t.setRenderTarget(i,0,s),m&&t.autoClear===!1&&t.clearDepth(),t.render(e,r),t.setRenderTarget(i,1,s),m&&t.autoClear===!1&&t.clearDepth(),t.render(e,o),t.setRenderTarget(i,2,s),m&&t.autoClear===!1&&t.clearDepth(),t.render(e,a),t.setRenderTarget(i,3,s),m&&t.autoClear===!1&&t.clearDepth(),t.render(e,l),t.setRenderTarget(i,4,s),m&&t.autoClear===!1&&t.clearDepth(),t.render(e,c),i.texture.mipmapsAutoUpdate=x,t.setRenderTarget(i,5,s),m&&t.autoClear===!1&&t.clearDepth(),t.render(e,h),t.setRenderTarget(d,u,p),t.xr.enabled=g,i.texture.needsPMREMUpdate=!0}}class zv extends Pn{constructor(t=[]){super(),this.isArrayCamera=!0,this.isMultiViewCamera=!1,this.cameras=t,this.perCameraFrustumCulled=!1}}const Hu=new Yt;class Cf{constructor(t,e,i=0,s=1/0){this.ray=new js(t,e),this.near=i,this.far=s,this.camera=null,this.layers=new eh,this.params={Mesh:{},Line:{threshold:1},LOD:{},Points:{threshold:1},Sprite:{}}}set(t,e){this.ray.set(t,e)}setFromCamera(t,e){e.isPerspectiveCamera?(this.ray.origin.setFromMatrixPosition(e.matrixWorld),this.ray.direction.set(t.x,t.y,.5).unproject(e).sub(this.ray.origin).normalize(),this.camera=e):e.isOrthographicCamera?(this.ray.origin.set(t.x,t.y,e.projectionMatrix.elements[14]).unproject(e),this.ray.direction.set(0,0,-1).transformDirection(e.matrixWorld),this.camera=e):Qt("Raycaster: Unsupported camera type: "+e.type)}setFromXRController(t){return Hu.identity().extractRotation(t.matrixWorld),this.ray.origin.setFromMatrixPosition(t.matrixWorld),this.ray.direction.set(0,0,-1).applyMatrix4(Hu),this}intersectObject(t,e=!0,i=[]){return Tc(t,this,i,e),i.sort(Gu),i}intersectObjects(t,e=!0,i=[]){for(let s=0,r=t.length;s<r;s++)Tc(t[s],this,i,e);return i.sort(Gu),i}}function Gu(n,t){return n.distance-t.distance}function Tc(n,t,e,i){let s=!0;if(n.layers.test(t.layers)&&n.raycast(t,e)===!1&&(s=!1),s===!0&&i===!0){const r=n.children;for(let o=0,a=r.length;o<a;o++)Tc(r[o],t,e,!0)}}class Wu{constructor(t=1,e=0,i=0){this.radius=t,this.phi=e,this.theta=i}set(t,e,i){return this.radius=t,this.phi=e,this.theta=i,this}copy(t){return this.radius=t.radius,this.phi=t.phi,this.theta=t.theta,this}makeSafe(){return this.phi=Ht(this.phi,1e-6,Math.PI-1e-6),this}setFromVector3(t){return this.setFromCartesianCoords(t.x,t.y,t.z)}setFromCartesianCoords(t,e,i){return this.radius=Math.sqrt(t*t+e*e+i*i),this.radius===0?(this.theta=0,this.phi=0):(this.theta=Math.atan2(t,i),this.phi=Math.acos(Ht(e/this.radius,-1,1))),this}clone(){return new this.constructor().copy(this)}}class Rf extends Gi{constructor(t,e=null){super(),this.object=t,this.domElement=e,this.enabled=!0,this.state=-1,this.keys={},this.mouseButtons={LEFT:null,MIDDLE:null,RIGHT:null},this.touches={ONE:null,TWO:null}}connect(t){this.domElement!==null&&this.disconnect(),this.domElement=t}disconnect(){}dispose(){}update(){}}function Xu(n,t,e,i){const s=Vv(i);switch(e){case rf:return n*t;case Yc:return n*t/s.components*s.byteLength;case Kc:return n*t/s.components*s.byteLength;case is:return n*t*2/s.components*s.byteLength;case Zc:return n*t*2/s.components*s.byteLength;case of:return n*t*3/s.components*s.byteLength;case Wn:return n*t*4/s.components*s.byteLength;case jc:return n*t*4/s.components*s.byteLength;case Yo:case Ko:return Math.floor((n+3)/4)*Math.floor((t+3)/4)*8;case Zo:case jo:return Math.floor((n+3)/4)*Math.floor((t+3)/4)*16;case Kl:case jl:return Math.max(n,16)*Math.max(t,8)/4;case Yl:case Zl:return Math.max(n,8)*Math.max(t,8)/2;case Ql:case Jl:case ec:case nc:return Math.floor((n+3)/4)*Math.floor((t+3)/4)*8;case tc:case oa:case ic:return Math.floor((n+3)/4)*Math.floor((t+3)/4)*16;case sc:return Math.floor((n+3)/4)*Math.floor((t+3)/4)*16;case rc:return Math.floor((n+4)/5)*Math.floor((t+3)/4)*16;case oc:return Math.floor((n+4)/5)*Math.floor((t+4)/5)*16;case ac:return Math.floor((n+5)/6)*Math.floor((t+4)/5)*16;case lc:return Math.floor((n+5)/6)*Math.floor((t+5)/6)*16;case cc:return Math.floor((n+7)/8)*Math.floor((t+4)/5)*16;case hc:return Math.floor((n+7)/8)*Math.floor((t+5)/6)*16;case uc:return Math.floor((n+7)/8)*Math.floor((t+7)/8)*16;case dc:return Math.floor((n+9)/10)*Math.floor((t+4)/5)*16;case pc:return Math.floor((n+9)/10)*Math.floor((t+5)/6)*16;case fc:return Math.floor((n+9)/10)*Math.floor((t+7)/8)*16;case mc:return Math.floor((n+9)/10)*Math.floor((t+9)/10)*16;case gc:return Math.floor((n+11)/12)*Math.floor((t+9)/10)*16;case vc:return Math.floor((n+11)/12)*Math.floor((t+11)/12)*16;case _c:case xc:case bc:return Math.ceil(n/4)*Math.ceil(t/4)*16;case wc:case yc:return Math.ceil(n/4)*Math.ceil(t/4)*8;case aa:case Sc:return Math.ceil(n/4)*Math.ceil(t/4)*16}throw new Error(`Unable to determine texture byte length for ${e} format.`)}function Vv(n){switch(n){case yn:case tf:return{byteLength:1,components:1};case Dr:case ef:case Yn:return{byteLength:2,components:1};case qc:case $c:return{byteLength:2,components:4};case $n:case Xc:case Nn:return{byteLength:4,components:1};case nf:case sf:return{byteLength:4,components:3}}throw new Error(`THREE.TextureUtils: Unknown texture type ${n}.`)}typeof __THREE_DEVTOOLS__<"u"&&__THREE_DEVTOOLS__.dispatchEvent(new CustomEvent("register",{detail:{revision:"187"}}));typeof window<"u"&&(window.__THREE__?Dt("WARNING: Multiple instances of Three.js being imported."):window.__THREE__="187");/**
 * @license
 * Copyright 2010-2026 Three.js Authors
 * SPDX-License-Identifier: MIT
 */function Pf(){let n=null,t=!1,e=null,i=null;function s(r,o){i=n.requestAnimationFrame(s),e(r,o)}return{start:function(){t!==!0&&e!==null&&n!==null&&(i=n.requestAnimationFrame(s),t=!0)},stop:function(){n!==null&&n.cancelAnimationFrame(i),t=!1},setAnimationLoop:function(r){e=r},setContext:function(r){n=r}}}function Hv(n){const t=new WeakMap;function e(a,l){const c=a.array,h=a.usage,d=c.byteLength,u=n.createBuffer();n.bindBuffer(l,u),n.bufferData(l,c,h),a.onUploadCallback();let p;if(c instanceof Float32Array)p=n.FLOAT;else if(typeof Float16Array<"u"&&c instanceof Float16Array)p=n.HALF_FLOAT;else if(c instanceof Uint16Array)a.isFloat16BufferAttribute?p=n.HALF_FLOAT:p=n.UNSIGNED_SHORT;else if(c instanceof Int16Array)p=n.SHORT;else if(c instanceof Uint32Array)p=n.UNSIGNED_INT;else if(c instanceof Int32Array)p=n.INT;else if(c instanceof Int8Array)p=n.BYTE;else if(c instanceof Uint8Array)p=n.UNSIGNED_BYTE;else if(c instanceof Uint8ClampedArray)p=n.UNSIGNED_BYTE;else throw new Error("THREE.WebGLAttributes: Unsupported buffer data format: "+c);return{buffer:u,type:p,bytesPerElement:c.BYTES_PER_ELEMENT,version:a.version,size:d}}function i(a,l,c){const h=l.array,d=l.updateRanges;if(n.bindBuffer(c,a),d.length===0)n.bufferSubData(c,0,h);else{d.sort((p,g)=>p.start-g.start);let u=0;for(let p=1;p<d.length;p++){const g=d[u],x=d[p];x.start<=g.start+g.count+1?g.count=Math.max(g.count,x.start+x.count-g.start):(++u,d[u]=x)}d.length=u+1;for(let p=0,g=d.length;p<g;p++){const x=d[p];n.bufferSubData(c,x.start*h.BYTES_PER_ELEMENT,h,x.start,x.count)}l.clearUpdateRanges()}l.onUploadCallback()}function s(a){return a.isInterleavedBufferAttribute&&(a=a.data),t.get(a)}function r(a){a.isInterleavedBufferAttribute&&(a=a.data);const l=t.get(a);l&&(n.deleteBuffer(l.buffer),t.delete(a))}function o(a,l){if(a.isInterleavedBufferAttribute&&(a=a.data),a.isGLBufferAttribute){const h=t.get(a);(!h||h.version<a.version)&&t.set(a,{buffer:a.buffer,type:a.type,bytesPerElement:a.elementSize,version:a.version});return}const c=t.get(a);if(c===void 0)t.set(a,e(a,l));else if(c.version<a.version){if(c.size!==a.array.byteLength)throw new Error("THREE.WebGLAttributes: The size of the buffer attribute's array buffer does not match the original size. Resizing buffer attributes is not supported.");i(c.buffer,a,l),c.version=a.version}}return{get:s,remove:r,update:o}}var Gv=`#ifdef USE_ALPHAHASH
	if ( diffuseColor.a < getAlphaHashThreshold( vPosition ) ) discard;
#endif`,Wv=`#ifdef USE_ALPHAHASH
	const float ALPHA_HASH_SCALE = 0.05;
	float hash2D( vec2 value ) {
		return fract( 1.0e4 * sin( 17.0 * value.x + 0.1 * value.y ) * ( 0.1 + abs( sin( 13.0 * value.y + value.x ) ) ) );
	}
	float hash3D( vec3 value ) {
		return hash2D( vec2( hash2D( value.xy ), value.z ) );
	}
	float getAlphaHashThreshold( vec3 position ) {
		float maxDeriv = max(
			length( dFdx( position.xyz ) ),
			length( dFdy( position.xyz ) )
		);
		float pixScale = 1.0 / ( ALPHA_HASH_SCALE * maxDeriv );
		vec2 pixScales = vec2(
			exp2( floor( log2( pixScale ) ) ),
			exp2( ceil( log2( pixScale ) ) )
		);
		vec2 alpha = vec2(
			hash3D( floor( pixScales.x * position.xyz ) ),
			hash3D( floor( pixScales.y * position.xyz ) )
		);
		float lerpFactor = fract( log2( pixScale ) );
		float x = ( 1.0 - lerpFactor ) * alpha.x + lerpFactor * alpha.y;
		float a = min( lerpFactor, 1.0 - lerpFactor );
		vec3 cases = vec3(
			x * x / ( 2.0 * a * ( 1.0 - a ) ),
			( x - 0.5 * a ) / ( 1.0 - a ),
			1.0 - ( ( 1.0 - x ) * ( 1.0 - x ) / ( 2.0 * a * ( 1.0 - a ) ) )
		);
		float threshold = ( x < ( 1.0 - a ) )
			? ( ( x < a ) ? cases.x : cases.y )
			: cases.z;
		return clamp( threshold , 1.0e-6, 1.0 );
	}
#endif`,Xv=`#ifdef USE_ALPHAMAP
	diffuseColor.a *= texture2D( alphaMap, vAlphaMapUv ).g;
#endif`,qv=`#ifdef USE_ALPHAMAP
	uniform sampler2D alphaMap;
#endif`,$v=`#ifdef USE_ALPHATEST
	#ifdef ALPHA_TO_COVERAGE
	diffuseColor.a = smoothstep( alphaTest, alphaTest + fwidth( diffuseColor.a ), diffuseColor.a );
	if ( diffuseColor.a == 0.0 ) discard;
	#else
	if ( diffuseColor.a < alphaTest ) discard;
	#endif
#endif`,Yv=`#ifdef USE_ALPHATEST
	uniform float alphaTest;
#endif`,Kv=`#ifdef USE_AOMAP
	float ambientOcclusion = ( texture2D( aoMap, vAoMapUv ).r - 1.0 ) * aoMapIntensity + 1.0;
	reflectedLight.indirectDiffuse *= ambientOcclusion;
	#if defined( USE_CLEARCOAT ) 
		clearcoatSpecularIndirect *= ambientOcclusion;
	#endif
	#if defined( USE_SHEEN ) 
		sheenSpecularIndirect *= ambientOcclusion;
	#endif
	#if defined( USE_ENVMAP ) && defined( STANDARD )
		float dotNV = saturate( dot( geometryNormal, geometryViewDir ) );
		reflectedLight.indirectSpecular *= computeSpecularOcclusion( dotNV, ambientOcclusion, material.roughness );
	#endif
#endif`,Zv=`#ifdef USE_AOMAP
	uniform sampler2D aoMap;
	uniform float aoMapIntensity;
#endif`,jv=`#ifdef USE_BATCHING
	#if ! defined( GL_ANGLE_multi_draw )
	#define gl_DrawID _gl_DrawID
	uniform int _gl_DrawID;
	#endif
	uniform highp sampler2D batchingTexture;
	uniform highp usampler2D batchingIdTexture;
	mat4 getBatchingMatrix( const in float i ) {
		int size = textureSize( batchingTexture, 0 ).x;
		int j = int( i ) * 4;
		int x = j % size;
		int y = j / size;
		vec4 v1 = texelFetch( batchingTexture, ivec2( x, y ), 0 );
		vec4 v2 = texelFetch( batchingTexture, ivec2( x + 1, y ), 0 );
		vec4 v3 = texelFetch( batchingTexture, ivec2( x + 2, y ), 0 );
		vec4 v4 = texelFetch( batchingTexture, ivec2( x + 3, y ), 0 );
		return mat4( v1, v2, v3, v4 );
	}
	float getIndirectIndex( const in int i ) {
		int size = textureSize( batchingIdTexture, 0 ).x;
		int x = i % size;
		int y = i / size;
		return float( texelFetch( batchingIdTexture, ivec2( x, y ), 0 ).r );
	}
#endif
#ifdef USE_BATCHING_COLOR
	uniform sampler2D batchingColorTexture;
	vec4 getBatchingColor( const in float i ) {
		int size = textureSize( batchingColorTexture, 0 ).x;
		int j = int( i );
		int x = j % size;
		int y = j / size;
		return texelFetch( batchingColorTexture, ivec2( x, y ), 0 );
	}
#endif`,Qv=`#ifdef USE_BATCHING
	mat4 batchingMatrix = getBatchingMatrix( getIndirectIndex( gl_DrawID ) );
#endif`,Jv=`vec3 transformed = vec3( position );
#ifdef USE_ALPHAHASH
	vPosition = vec3( position );
#endif`,t_=`vec3 objectNormal = vec3( normal );
#ifdef USE_TANGENT
	vec3 objectTangent = vec3( tangent.xyz );
#endif`,e_=`float G_BlinnPhong_Implicit( ) {
	return 0.25;
}
float D_BlinnPhong( const in float shininess, const in float dotNH ) {
	return RECIPROCAL_PI * ( shininess * 0.5 + 1.0 ) * pow( dotNH, shininess );
}
vec3 BRDF_BlinnPhong( const in vec3 lightDir, const in vec3 viewDir, const in vec3 normal, const in vec3 specularColor, const in float shininess ) {
	vec3 halfDir = normalize( lightDir + viewDir );
	float dotNH = saturate( dot( normal, halfDir ) );
	float dotVH = saturate( dot( viewDir, halfDir ) );
	vec3 F = F_Schlick( specularColor, 1.0, dotVH );
	float G = G_BlinnPhong_Implicit( );
	float D = D_BlinnPhong( shininess, dotNH );
	return F * ( G * D );
} // validated`,n_=`#ifdef USE_IRIDESCENCE
	const mat3 XYZ_TO_REC709 = mat3(
		 3.2404542, -0.9692660,  0.0556434,
		-1.5371385,  1.8760108, -0.2040259,
		-0.4985314,  0.0415560,  1.0572252
	);
	vec3 Fresnel0ToIor( vec3 fresnel0 ) {
		vec3 sqrtF0 = sqrt( fresnel0 );
		return ( vec3( 1.0 ) + sqrtF0 ) / ( vec3( 1.0 ) - sqrtF0 );
	}
	vec3 IorToFresnel0( vec3 transmittedIor, float incidentIor ) {
		return pow2( ( transmittedIor - vec3( incidentIor ) ) / ( transmittedIor + vec3( incidentIor ) ) );
	}
	float IorToFresnel0( float transmittedIor, float incidentIor ) {
		return pow2( ( transmittedIor - incidentIor ) / ( transmittedIor + incidentIor ));
	}
	vec3 evalSensitivity( float OPD, vec3 shift ) {
		float phase = 2.0 * PI * OPD * 1.0e-9;
		vec3 val = vec3( 5.4856e-13, 4.4201e-13, 5.2481e-13 );
		vec3 pos = vec3( 1.6810e+06, 1.7953e+06, 2.2084e+06 );
		vec3 var = vec3( 4.3278e+09, 9.3046e+09, 6.6121e+09 );
		vec3 xyz = val * sqrt( 2.0 * PI * var ) * cos( pos * phase + shift ) * exp( - pow2( phase ) * var );
		xyz.x += 9.7470e-14 * sqrt( 2.0 * PI * 4.5282e+09 ) * cos( 2.2399e+06 * phase + shift[ 0 ] ) * exp( - 4.5282e+09 * pow2( phase ) );
		xyz /= 1.0685e-7;
		vec3 rgb = XYZ_TO_REC709 * xyz;
		return rgb;
	}
	vec3 evalIridescence( float outsideIOR, float eta2, float cosTheta1, float thinFilmThickness, vec3 baseF0 ) {
		vec3 I;
		float iridescenceIOR = mix( outsideIOR, eta2, smoothstep( 0.0, 0.03, thinFilmThickness ) );
		float sinTheta2Sq = pow2( outsideIOR / iridescenceIOR ) * ( 1.0 - pow2( cosTheta1 ) );
		float cosTheta2Sq = 1.0 - sinTheta2Sq;
		if ( cosTheta2Sq < 0.0 ) {
			return vec3( 1.0 );
		}
		float cosTheta2 = sqrt( cosTheta2Sq );
		float R0 = IorToFresnel0( iridescenceIOR, outsideIOR );
		float R12 = F_Schlick( R0, 1.0, cosTheta1 );
		float T121 = 1.0 - R12;
		float phi12 = 0.0;
		if ( iridescenceIOR < outsideIOR ) phi12 = PI;
		float phi21 = PI - phi12;
		vec3 baseIOR = Fresnel0ToIor( clamp( baseF0, 0.0, 0.9999 ) );		vec3 R1 = IorToFresnel0( baseIOR, iridescenceIOR );
		vec3 R23 = F_Schlick( R1, 1.0, cosTheta2 );
		vec3 phi23 = vec3( 0.0 );
		if ( baseIOR[ 0 ] < iridescenceIOR ) phi23[ 0 ] = PI;
		if ( baseIOR[ 1 ] < iridescenceIOR ) phi23[ 1 ] = PI;
		if ( baseIOR[ 2 ] < iridescenceIOR ) phi23[ 2 ] = PI;
		float OPD = 2.0 * iridescenceIOR * thinFilmThickness * cosTheta2;
		vec3 phi = vec3( phi21 ) + phi23;
		vec3 R123 = clamp( R12 * R23, 1e-5, 0.9999 );
		vec3 r123 = sqrt( R123 );
		vec3 Rs = pow2( T121 ) * R23 / ( vec3( 1.0 ) - R123 );
		vec3 C0 = R12 + Rs;
		I = C0;
		vec3 Cm = Rs - T121;
		for ( int m = 1; m <= 2; ++ m ) {
			Cm *= r123;
			vec3 Sm = 2.0 * evalSensitivity( float( m ) * OPD, float( m ) * phi );
			I += Cm * Sm;
		}
		return max( I, vec3( 0.0 ) );
	}
#endif`,i_=`#ifdef USE_BUMPMAP
	uniform sampler2D bumpMap;
	uniform float bumpScale;
	vec2 dHdxy_fwd() {
		vec2 dSTdx = dFdx( vBumpMapUv );
		vec2 dSTdy = dFdy( vBumpMapUv );
		float Hll = bumpScale * texture2D( bumpMap, vBumpMapUv ).x;
		float dBx = bumpScale * texture2D( bumpMap, vBumpMapUv + dSTdx ).x - Hll;
		float dBy = bumpScale * texture2D( bumpMap, vBumpMapUv + dSTdy ).x - Hll;
		return vec2( dBx, dBy );
	}
	vec3 perturbNormalArb( vec3 surf_pos, vec3 surf_norm, vec2 dHdxy, float faceDirection ) {
		vec3 vSigmaX = normalize( dFdx( surf_pos.xyz ) );
		vec3 vSigmaY = normalize( dFdy( surf_pos.xyz ) );
		vec3 vN = surf_norm;
		vec3 R1 = cross( vSigmaY, vN );
		vec3 R2 = cross( vN, vSigmaX );
		float fDet = dot( vSigmaX, R1 ) * faceDirection;
		vec3 vGrad = sign( fDet ) * ( dHdxy.x * R1 + dHdxy.y * R2 );
		return normalize( abs( fDet ) * surf_norm - vGrad );
	}
#endif`,s_=`#if NUM_CLIPPING_PLANES > 0
	vec4 plane;
	#ifdef ALPHA_TO_COVERAGE
		float distanceToPlane, distanceGradient;
		float clipOpacity = 1.0;
		#pragma unroll_loop_start
		for ( int i = 0; i < UNION_CLIPPING_PLANES; i ++ ) {
			plane = clippingPlanes[ i ];
			distanceToPlane = - dot( vClipPosition, plane.xyz ) + plane.w;
			distanceGradient = fwidth( distanceToPlane ) / 2.0;
			clipOpacity *= smoothstep( - distanceGradient, distanceGradient, distanceToPlane );
			if ( clipOpacity == 0.0 ) discard;
		}
		#pragma unroll_loop_end
		#if UNION_CLIPPING_PLANES < NUM_CLIPPING_PLANES
			float unionClipOpacity = 1.0;
			#pragma unroll_loop_start
			for ( int i = UNION_CLIPPING_PLANES; i < NUM_CLIPPING_PLANES; i ++ ) {
				plane = clippingPlanes[ i ];
				distanceToPlane = - dot( vClipPosition, plane.xyz ) + plane.w;
				distanceGradient = fwidth( distanceToPlane ) / 2.0;
				unionClipOpacity *= 1.0 - smoothstep( - distanceGradient, distanceGradient, distanceToPlane );
			}
			#pragma unroll_loop_end
			clipOpacity *= 1.0 - unionClipOpacity;
		#endif
		diffuseColor.a *= clipOpacity;
		if ( diffuseColor.a == 0.0 ) discard;
	#else
		#pragma unroll_loop_start
		for ( int i = 0; i < UNION_CLIPPING_PLANES; i ++ ) {
			plane = clippingPlanes[ i ];
			if ( dot( vClipPosition, plane.xyz ) > plane.w ) discard;
		}
		#pragma unroll_loop_end
		#if UNION_CLIPPING_PLANES < NUM_CLIPPING_PLANES
			bool clipped = true;
			#pragma unroll_loop_start
			for ( int i = UNION_CLIPPING_PLANES; i < NUM_CLIPPING_PLANES; i ++ ) {
				plane = clippingPlanes[ i ];
				clipped = ( dot( vClipPosition, plane.xyz ) > plane.w ) && clipped;
			}
			#pragma unroll_loop_end
			if ( clipped ) discard;
		#endif
	#endif
#endif`,r_=`#if NUM_CLIPPING_PLANES > 0
	varying vec3 vClipPosition;
	uniform vec4 clippingPlanes[ NUM_CLIPPING_PLANES ];
#endif`,o_=`#if NUM_CLIPPING_PLANES > 0
	varying vec3 vClipPosition;
#endif`,a_=`#if NUM_CLIPPING_PLANES > 0
	vClipPosition = - mvPosition.xyz;
#endif`,l_=`#if defined( USE_COLOR ) || defined( USE_COLOR_ALPHA )
	diffuseColor *= vColor;
#endif`,c_=`#if defined( USE_COLOR ) || defined( USE_COLOR_ALPHA )
	varying vec4 vColor;
#endif`,h_=`#if defined( USE_COLOR ) || defined( USE_COLOR_ALPHA ) || defined( USE_INSTANCING_COLOR ) || defined( USE_BATCHING_COLOR )
	varying vec4 vColor;
#endif`,u_=`#if defined( USE_COLOR ) || defined( USE_COLOR_ALPHA ) || defined( USE_INSTANCING_COLOR ) || defined( USE_BATCHING_COLOR )
	vColor = vec4( 1.0 );
#endif
#ifdef USE_COLOR_ALPHA
	vColor *= color;
#elif defined( USE_COLOR )
	vColor.rgb *= color;
#endif
#ifdef USE_INSTANCING_COLOR
	vColor.rgb *= instanceColor.rgb;
#endif
#ifdef USE_BATCHING_COLOR
	vColor *= getBatchingColor( getIndirectIndex( gl_DrawID ) );
#endif`,d_=`#define PI 3.141592653589793
#define PI2 6.283185307179586
#define PI_HALF 1.5707963267948966
#define RECIPROCAL_PI 0.3183098861837907
#define RECIPROCAL_PI2 0.15915494309189535
#define EPSILON 1e-6
#ifndef saturate
#define saturate( a ) clamp( a, 0.0, 1.0 )
#endif
#define whiteComplement( a ) ( 1.0 - saturate( a ) )
float pow2( const in float x ) { return x*x; }
vec3 pow2( const in vec3 x ) { return x*x; }
float pow3( const in float x ) { return x*x*x; }
float pow4( const in float x ) { float x2 = x*x; return x2*x2; }
float max3( const in vec3 v ) { return max( max( v.x, v.y ), v.z ); }
float average( const in vec3 v ) { return dot( v, vec3( 0.3333333 ) ); }
highp float rand( const in vec2 uv ) {
	const highp float a = 12.9898, b = 78.233, c = 43758.5453;
	highp float dt = dot( uv.xy, vec2( a,b ) ), sn = mod( dt, PI );
	return fract( sin( sn ) * c );
}
#ifdef HIGH_PRECISION
	float precisionSafeLength( vec3 v ) { return length( v ); }
#else
	float precisionSafeLength( vec3 v ) {
		float maxComponent = max3( abs( v ) );
		return length( v / maxComponent ) * maxComponent;
	}
#endif
struct IncidentLight {
	vec3 color;
	vec3 direction;
	bool visible;
};
struct ReflectedLight {
	vec3 directDiffuse;
	vec3 directSpecular;
	vec3 indirectDiffuse;
	vec3 indirectSpecular;
};
#ifdef USE_ALPHAHASH
	varying vec3 vPosition;
#endif
vec3 transformDirection( in vec3 dir, in mat4 matrix ) {
	return normalize( ( matrix * vec4( dir, 0.0 ) ).xyz );
}
#define inverseTransformDirection transformDirectionByInverseViewMatrix
vec3 transformNormalByInverseViewMatrix( in vec3 normal, in mat4 viewMatrix ) {
	return normalize( ( vec4( normal, 0.0 ) * viewMatrix ).xyz );
}
vec3 transformDirectionByInverseViewMatrix( in vec3 dir, in mat4 viewMatrix ) {
	return normalize( ( vec4( dir, 0.0 ) * viewMatrix ).xyz );
}
bool isPerspectiveMatrix( mat4 m ) {
	return m[ 2 ][ 3 ] == - 1.0;
}
vec2 equirectUv( in vec3 dir ) {
	float u = atan( dir.z, dir.x ) * RECIPROCAL_PI2 + 0.5;
	float v = asin( clamp( dir.y, - 1.0, 1.0 ) ) * RECIPROCAL_PI + 0.5;
	return vec2( u, v );
}
vec3 BRDF_Lambert( const in vec3 diffuseColor ) {
	return RECIPROCAL_PI * diffuseColor;
}
vec3 F_Schlick( const in vec3 f0, const in float f90, const in float dotVH ) {
	float fresnel = exp2( ( - 5.55473 * dotVH - 6.98316 ) * dotVH );
	return f0 * ( 1.0 - fresnel ) + ( f90 * fresnel );
}
float F_Schlick( const in float f0, const in float f90, const in float dotVH ) {
	float fresnel = exp2( ( - 5.55473 * dotVH - 6.98316 ) * dotVH );
	return f0 * ( 1.0 - fresnel ) + ( f90 * fresnel );
} // validated`,p_=`vec3 transformedNormal = objectNormal;
#ifdef USE_TANGENT
	vec3 transformedTangent = objectTangent;
#endif
#ifdef USE_BATCHING
	mat3 bm = mat3( batchingMatrix );
	transformedNormal /= vec3( dot( bm[ 0 ], bm[ 0 ] ), dot( bm[ 1 ], bm[ 1 ] ), dot( bm[ 2 ], bm[ 2 ] ) );
	transformedNormal = bm * transformedNormal;
	#ifdef USE_TANGENT
		transformedTangent = bm * transformedTangent;
	#endif
#endif
#ifdef USE_INSTANCING
	mat3 im = mat3( instanceMatrix );
	transformedNormal /= vec3( dot( im[ 0 ], im[ 0 ] ), dot( im[ 1 ], im[ 1 ] ), dot( im[ 2 ], im[ 2 ] ) );
	transformedNormal = im * transformedNormal;
	#ifdef USE_TANGENT
		transformedTangent = im * transformedTangent;
	#endif
#endif
transformedNormal = normalMatrix * transformedNormal;
#ifdef FLIP_SIDED
	transformedNormal = - transformedNormal;
#endif
#ifdef USE_TANGENT
	transformedTangent = ( modelViewMatrix * vec4( transformedTangent, 0.0 ) ).xyz;
#endif`,f_=`#ifdef USE_DISPLACEMENTMAP
	uniform sampler2D displacementMap;
	uniform float displacementScale;
	uniform float displacementBias;
#endif`,m_=`#ifdef USE_DISPLACEMENTMAP
	transformed += normalize( objectNormal ) * ( texture2D( displacementMap, vDisplacementMapUv ).x * displacementScale + displacementBias );
#endif`,g_=`#ifdef USE_EMISSIVEMAP
	vec4 emissiveColor = texture2D( emissiveMap, vEmissiveMapUv );
	#ifdef DECODE_VIDEO_TEXTURE_EMISSIVE
		emissiveColor = sRGBTransferEOTF( emissiveColor );
	#endif
	totalEmissiveRadiance *= emissiveColor.rgb;
#endif`,v_=`#ifdef USE_EMISSIVEMAP
	uniform sampler2D emissiveMap;
#endif`,__="gl_FragColor = linearToOutputTexel( gl_FragColor );",x_=`vec4 LinearTransferOETF( in vec4 value ) {
	return value;
}
vec4 sRGBTransferEOTF( in vec4 value ) {
	return vec4( mix( pow( value.rgb * 0.9478672986 + vec3( 0.0521327014 ), vec3( 2.4 ) ), value.rgb * 0.0773993808, vec3( lessThanEqual( value.rgb, vec3( 0.04045 ) ) ) ), value.a );
}
vec4 sRGBTransferOETF( in vec4 value ) {
	return vec4( mix( pow( value.rgb, vec3( 0.41666 ) ) * 1.055 - vec3( 0.055 ), value.rgb * 12.92, vec3( lessThanEqual( value.rgb, vec3( 0.0031308 ) ) ) ), value.a );
}`,b_=`#ifdef USE_ENVMAP
	#ifdef ENV_WORLDPOS
		vec3 cameraToFrag;
		if ( isOrthographic ) {
			cameraToFrag = normalize( vec3( - viewMatrix[ 0 ][ 2 ], - viewMatrix[ 1 ][ 2 ], - viewMatrix[ 2 ][ 2 ] ) );
		} else {
			cameraToFrag = normalize( vWorldPosition - cameraPosition );
		}
		vec3 worldNormal = transformNormalByInverseViewMatrix( normal, viewMatrix );
		#ifdef ENVMAP_MODE_REFLECTION
			vec3 reflectVec = reflect( cameraToFrag, worldNormal );
		#else
			vec3 reflectVec = refract( cameraToFrag, worldNormal, refractionRatio );
		#endif
	#else
		vec3 reflectVec = vReflect;
	#endif
	#ifdef ENVMAP_TYPE_CUBE
		vec4 envColor = textureCube( envMap, envMapRotation * reflectVec );
		#ifdef ENVMAP_BLENDING_MULTIPLY
			outgoingLight = mix( outgoingLight, outgoingLight * envColor.xyz, specularStrength * reflectivity );
		#elif defined( ENVMAP_BLENDING_MIX )
			outgoingLight = mix( outgoingLight, envColor.xyz, specularStrength * reflectivity );
		#elif defined( ENVMAP_BLENDING_ADD )
			outgoingLight += envColor.xyz * specularStrength * reflectivity;
		#endif
	#endif
#endif`,w_=`#ifdef USE_ENVMAP
	uniform float envMapIntensity;
	uniform mat3 envMapRotation;
	uniform samplerCube envMap;
	#ifdef ENVMAP_TYPE_PMREM
		float roughnessToMip( const in float roughness ) {
			float r = clamp( roughness, 0.0, 1.0 );
			return ENVMAP_MAX_LOD * r * ( 2.0 - r );
		}
	#endif
#endif`,y_=`#ifdef USE_ENVMAP
	uniform float reflectivity;
	#if defined( USE_BUMPMAP ) || defined( USE_NORMALMAP ) || defined( PHONG ) || defined( LAMBERT )
		#define ENV_WORLDPOS
	#endif
	#ifdef ENV_WORLDPOS
		varying vec3 vWorldPosition;
		uniform float refractionRatio;
	#else
		varying vec3 vReflect;
	#endif
#endif`,S_=`#ifdef USE_ENVMAP
	#if defined( USE_BUMPMAP ) || defined( USE_NORMALMAP ) || defined( PHONG ) || defined( LAMBERT )
		#define ENV_WORLDPOS
	#endif
	#ifdef ENV_WORLDPOS
		
		varying vec3 vWorldPosition;
	#else
		varying vec3 vReflect;
		uniform float refractionRatio;
	#endif
#endif`,E_=`#ifdef USE_ENVMAP
	#ifdef ENV_WORLDPOS
		vWorldPosition = worldPosition.xyz;
	#else
		vec3 cameraToVertex;
		if ( isOrthographic ) {
			cameraToVertex = normalize( vec3( - viewMatrix[ 0 ][ 2 ], - viewMatrix[ 1 ][ 2 ], - viewMatrix[ 2 ][ 2 ] ) );
		} else {
			cameraToVertex = normalize( worldPosition.xyz - cameraPosition );
		}
		vec3 worldNormal = transformNormalByInverseViewMatrix( transformedNormal, viewMatrix );
		#ifdef ENVMAP_MODE_REFLECTION
			vReflect = reflect( cameraToVertex, worldNormal );
		#else
			vReflect = refract( cameraToVertex, worldNormal, refractionRatio );
		#endif
	#endif
#endif`,M_=`#ifdef USE_FOG
	vFogDepth = - mvPosition.z;
#endif`,T_=`#ifdef USE_FOG
	varying float vFogDepth;
#endif`,A_=`#ifdef USE_FOG
	#ifdef FOG_EXP2
		float fogFactor = 1.0 - exp( - fogDensity * fogDensity * vFogDepth * vFogDepth );
	#else
		float fogFactor = smoothstep( fogNear, fogFar, vFogDepth );
	#endif
	gl_FragColor.rgb = mix( gl_FragColor.rgb, fogColor, fogFactor );
#endif`,C_=`#ifdef USE_FOG
	uniform vec3 fogColor;
	varying float vFogDepth;
	#ifdef FOG_EXP2
		uniform float fogDensity;
	#else
		uniform float fogNear;
		uniform float fogFar;
	#endif
#endif`,R_=`#ifdef USE_GRADIENTMAP
	uniform sampler2D gradientMap;
#endif
vec3 getGradientIrradiance( vec3 normal, vec3 lightDirection ) {
	float dotNL = dot( normal, lightDirection );
	vec2 coord = vec2( dotNL * 0.5 + 0.5, 0.0 );
	#ifdef USE_GRADIENTMAP
		return vec3( texture2D( gradientMap, coord ).r );
	#else
		vec2 fw = fwidth( coord ) * 0.5;
		return mix( vec3( 0.7 ), vec3( 1.0 ), smoothstep( 0.7 - fw.x, 0.7 + fw.x, coord.x ) );
	#endif
}`,P_=`#ifdef USE_LIGHTMAP
	uniform sampler2D lightMap;
	uniform float lightMapIntensity;
#endif`,L_=`LambertMaterial material;
material.diffuseColor = diffuseColor.rgb;
material.specularStrength = specularStrength;`,D_=`varying vec3 vViewPosition;
struct LambertMaterial {
	vec3 diffuseColor;
	float specularStrength;
};
void RE_Direct_Lambert( const in IncidentLight directLight, const in vec3 geometryPosition, const in vec3 geometryNormal, const in vec3 geometryViewDir, const in vec3 geometryClearcoatNormal, const in LambertMaterial material, inout ReflectedLight reflectedLight ) {
	float dotNL = saturate( dot( geometryNormal, directLight.direction ) );
	vec3 irradiance = dotNL * directLight.color;
	reflectedLight.directDiffuse += irradiance * BRDF_Lambert( material.diffuseColor );
}
void RE_IndirectDiffuse_Lambert( const in vec3 irradiance, const in vec3 geometryPosition, const in vec3 geometryNormal, const in vec3 geometryViewDir, const in vec3 geometryClearcoatNormal, const in LambertMaterial material, inout ReflectedLight reflectedLight ) {
	reflectedLight.indirectDiffuse += irradiance * BRDF_Lambert( material.diffuseColor );
}
#define RE_Direct				RE_Direct_Lambert
#define RE_IndirectDiffuse		RE_IndirectDiffuse_Lambert`,I_=`uniform bool receiveShadow;
uniform vec3 ambientLightColor;
#if defined( USE_LIGHT_PROBES )
	uniform vec3 lightProbe[ 9 ];
#endif
vec3 shGetIrradianceAt( in vec3 normal, in vec3 shCoefficients[ 9 ] ) {
	float x = normal.x, y = normal.y, z = normal.z;
	vec3 result = shCoefficients[ 0 ] * 0.886227;
	result += shCoefficients[ 1 ] * 2.0 * 0.511664 * y;
	result += shCoefficients[ 2 ] * 2.0 * 0.511664 * z;
	result += shCoefficients[ 3 ] * 2.0 * 0.511664 * x;
	result += shCoefficients[ 4 ] * 2.0 * 0.429043 * x * y;
	result += shCoefficients[ 5 ] * 2.0 * 0.429043 * y * z;
	result += shCoefficients[ 6 ] * ( 0.743125 * z * z - 0.247708 );
	result += shCoefficients[ 7 ] * 2.0 * 0.429043 * x * z;
	result += shCoefficients[ 8 ] * 0.429043 * ( x * x - y * y );
	return result;
}
vec3 getLightProbeIrradiance( const in vec3 lightProbe[ 9 ], const in vec3 normal ) {
	vec3 worldNormal = transformNormalByInverseViewMatrix( normal, viewMatrix );
	vec3 irradiance = shGetIrradianceAt( worldNormal, lightProbe );
	return irradiance;
}
vec3 getAmbientLightIrradiance( const in vec3 ambientLightColor ) {
	vec3 irradiance = ambientLightColor;
	return irradiance;
}
float getDistanceAttenuation( const in float lightDistance, const in float cutoffDistance, const in float decayExponent ) {
	float distanceFalloff = 1.0 / max( pow( lightDistance, decayExponent ), 0.01 );
	if ( cutoffDistance > 0.0 ) {
		distanceFalloff *= pow2( saturate( 1.0 - pow4( lightDistance / cutoffDistance ) ) );
	}
	return distanceFalloff;
}
float getSpotAttenuation( const in float coneCosine, const in float penumbraCosine, const in float angleCosine ) {
	return smoothstep( coneCosine, penumbraCosine, angleCosine );
}
#if NUM_SUN_LIGHTS > 0
	struct SunLight {
		vec3 direction;
		vec3 color;
	};
	uniform SunLight sunLights[ NUM_SUN_LIGHTS ];
	void getSunLightInfo( const in SunLight sunLight, out IncidentLight light ) {
		light.color = sunLight.color;
		light.direction = sunLight.direction;
		light.visible = true;
	}
#endif
#if NUM_DIR_LIGHTS > 0
	struct DirectionalLight {
		vec3 direction;
		vec3 color;
	};
	uniform DirectionalLight directionalLights[ NUM_DIR_LIGHTS ];
	void getDirectionalLightInfo( const in DirectionalLight directionalLight, out IncidentLight light ) {
		light.color = directionalLight.color;
		light.direction = directionalLight.direction;
		light.visible = true;
	}
#endif
#if NUM_POINT_LIGHTS > 0
	struct PointLight {
		vec3 position;
		vec3 color;
		float distance;
		float decay;
	};
	uniform PointLight pointLights[ NUM_POINT_LIGHTS ];
	void getPointLightInfo( const in PointLight pointLight, const in vec3 geometryPosition, out IncidentLight light ) {
		vec3 lVector = pointLight.position - geometryPosition;
		light.direction = normalize( lVector );
		float lightDistance = length( lVector );
		light.color = pointLight.color;
		light.color *= getDistanceAttenuation( lightDistance, pointLight.distance, pointLight.decay );
		light.visible = ( light.color != vec3( 0.0 ) );
	}
#endif
#if NUM_SPOT_LIGHTS > 0
	struct SpotLight {
		vec3 position;
		vec3 direction;
		vec3 color;
		float distance;
		float decay;
		float coneCos;
		float penumbraCos;
	};
	uniform SpotLight spotLights[ NUM_SPOT_LIGHTS ];
	void getSpotLightInfo( const in SpotLight spotLight, const in vec3 geometryPosition, out IncidentLight light ) {
		vec3 lVector = spotLight.position - geometryPosition;
		light.direction = normalize( lVector );
		float angleCos = dot( light.direction, spotLight.direction );
		float spotAttenuation = getSpotAttenuation( spotLight.coneCos, spotLight.penumbraCos, angleCos );
		if ( spotAttenuation > 0.0 ) {
			float lightDistance = length( lVector );
			light.color = spotLight.color * spotAttenuation;
			light.color *= getDistanceAttenuation( lightDistance, spotLight.distance, spotLight.decay );
			light.visible = ( light.color != vec3( 0.0 ) );
		} else {
			light.color = vec3( 0.0 );
			light.visible = false;
		}
	}
#endif
#if NUM_RECT_AREA_LIGHTS > 0
	struct RectAreaLight {
		vec3 color;
		vec3 position;
		vec3 halfWidth;
		vec3 halfHeight;
	};
	uniform sampler2D ltc_1;	uniform sampler2D ltc_2;
	uniform RectAreaLight rectAreaLights[ NUM_RECT_AREA_LIGHTS ];
#endif
#if NUM_HEMI_LIGHTS > 0
	struct HemisphereLight {
		vec3 direction;
		vec3 skyColor;
		vec3 groundColor;
	};
	uniform HemisphereLight hemisphereLights[ NUM_HEMI_LIGHTS ];
	vec3 getHemisphereLightIrradiance( const in HemisphereLight hemiLight, const in vec3 normal ) {
		float dotNL = dot( normal, hemiLight.direction );
		float hemiDiffuseWeight = 0.5 * dotNL + 0.5;
		vec3 irradiance = mix( hemiLight.groundColor, hemiLight.skyColor, hemiDiffuseWeight );
		return irradiance;
	}
#endif
#include <lightprobes_pars_fragment>`,N_=`#ifdef USE_ENVMAP
	vec3 getIBLIrradiance( const in vec3 normal ) {
		#ifdef ENVMAP_TYPE_PMREM
			vec3 worldNormal = transformNormalByInverseViewMatrix( normal, viewMatrix );
			vec4 envMapColor = textureLod( envMap, envMapRotation * worldNormal, ENVMAP_MAX_LOD );
			return PI * envMapColor.rgb * envMapIntensity;
		#else
			return vec3( 0.0 );
		#endif
	}
	vec3 getIBLRadiance( const in vec3 viewDir, const in vec3 normal, const in float roughness ) {
		#ifdef ENVMAP_TYPE_PMREM
			vec3 reflectVec = reflect( - viewDir, normal );
			reflectVec = normalize( mix( reflectVec, normal, pow4( roughness ) ) );
			reflectVec = transformDirectionByInverseViewMatrix( reflectVec, viewMatrix );
			vec4 envMapColor = textureLod( envMap, envMapRotation * reflectVec, roughnessToMip( roughness ) );
			return envMapColor.rgb * envMapIntensity;
		#else
			return vec3( 0.0 );
		#endif
	}
	#ifdef USE_RETROREFLECTION
		vec3 getIBLRetroRadiance( const in vec3 viewDir, const in vec3 normal, const in float roughness ) {
			#ifdef ENVMAP_TYPE_PMREM
				vec3 retroVec = normalize( mix( viewDir, normal, pow4( roughness ) ) );
				retroVec = transformDirectionByInverseViewMatrix( retroVec, viewMatrix );
				vec4 envMapColor = textureLod( envMap, envMapRotation * retroVec, roughnessToMip( roughness ) );
				return envMapColor.rgb * envMapIntensity;
			#else
				return vec3( 0.0 );
			#endif
		}
	#endif
	#ifdef USE_ANISOTROPY
		vec3 getIBLAnisotropyRadiance( const in vec3 viewDir, const in vec3 normal, const in float roughness, const in vec3 bitangent, const in float anisotropy ) {
			#ifdef ENVMAP_TYPE_PMREM
				vec3 bentNormal = cross( bitangent, viewDir );
				bentNormal = normalize( cross( bentNormal, bitangent ) );
				bentNormal = normalize( mix( bentNormal, normal, pow2( pow2( 1.0 - anisotropy * ( 1.0 - roughness ) ) ) ) );
				return getIBLRadiance( viewDir, bentNormal, roughness );
			#else
				return vec3( 0.0 );
			#endif
		}
		#ifdef USE_RETROREFLECTION
			vec3 getIBLAnisotropyRetroRadiance( const in vec3 viewDir, const in vec3 normal, const in float roughness, const in vec3 bitangent, const in float anisotropy ) {
				#ifdef ENVMAP_TYPE_PMREM
					vec3 bentNormal = cross( bitangent, viewDir );
					bentNormal = normalize( cross( bentNormal, bitangent ) );
					bentNormal = normalize( mix( bentNormal, normal, pow2( pow2( 1.0 - anisotropy * ( 1.0 - roughness ) ) ) ) );
					return getIBLRetroRadiance( viewDir, bentNormal, roughness );
				#else
					return vec3( 0.0 );
				#endif
			}
		#endif
	#endif
#endif`,U_=`ToonMaterial material;
material.diffuseColor = diffuseColor.rgb;`,O_=`varying vec3 vViewPosition;
struct ToonMaterial {
	vec3 diffuseColor;
};
void RE_Direct_Toon( const in IncidentLight directLight, const in vec3 geometryPosition, const in vec3 geometryNormal, const in vec3 geometryViewDir, const in vec3 geometryClearcoatNormal, const in ToonMaterial material, inout ReflectedLight reflectedLight ) {
	vec3 irradiance = getGradientIrradiance( geometryNormal, directLight.direction ) * directLight.color;
	reflectedLight.directDiffuse += irradiance * BRDF_Lambert( material.diffuseColor );
}
void RE_IndirectDiffuse_Toon( const in vec3 irradiance, const in vec3 geometryPosition, const in vec3 geometryNormal, const in vec3 geometryViewDir, const in vec3 geometryClearcoatNormal, const in ToonMaterial material, inout ReflectedLight reflectedLight ) {
	reflectedLight.indirectDiffuse += irradiance * BRDF_Lambert( material.diffuseColor );
}
#define RE_Direct				RE_Direct_Toon
#define RE_IndirectDiffuse		RE_IndirectDiffuse_Toon`,F_=`BlinnPhongMaterial material;
material.diffuseColor = diffuseColor.rgb;
material.specularColor = specular;
material.specularShininess = shininess;
material.specularStrength = specularStrength;`,k_=`varying vec3 vViewPosition;
struct BlinnPhongMaterial {
	vec3 diffuseColor;
	vec3 specularColor;
	float specularShininess;
	float specularStrength;
};
void RE_Direct_BlinnPhong( const in IncidentLight directLight, const in vec3 geometryPosition, const in vec3 geometryNormal, const in vec3 geometryViewDir, const in vec3 geometryClearcoatNormal, const in BlinnPhongMaterial material, inout ReflectedLight reflectedLight ) {
	float dotNL = saturate( dot( geometryNormal, directLight.direction ) );
	vec3 irradiance = dotNL * directLight.color;
	reflectedLight.directDiffuse += irradiance * BRDF_Lambert( material.diffuseColor );
	reflectedLight.directSpecular += irradiance * BRDF_BlinnPhong( directLight.direction, geometryViewDir, geometryNormal, material.specularColor, material.specularShininess ) * material.specularStrength;
}
void RE_IndirectDiffuse_BlinnPhong( const in vec3 irradiance, const in vec3 geometryPosition, const in vec3 geometryNormal, const in vec3 geometryViewDir, const in vec3 geometryClearcoatNormal, const in BlinnPhongMaterial material, inout ReflectedLight reflectedLight ) {
	reflectedLight.indirectDiffuse += irradiance * BRDF_Lambert( material.diffuseColor );
}
#define RE_Direct				RE_Direct_BlinnPhong
#define RE_IndirectDiffuse		RE_IndirectDiffuse_BlinnPhong`,B_=`PhysicalMaterial material;
material.diffuseColor = diffuseColor.rgb;
material.diffuseContribution = diffuseColor.rgb * ( 1.0 - metalnessFactor );
material.metalness = metalnessFactor;
vec3 dxy = max( abs( dFdx( nonPerturbedNormal ) ), abs( dFdy( nonPerturbedNormal ) ) );
float geometryRoughness = max( max( dxy.x, dxy.y ), dxy.z );
material.roughness = max( roughnessFactor, 0.045 );
material.roughness += geometryRoughness;
material.roughness = min( material.roughness, 1.0 );
#ifdef USE_DIFFUSE_ROUGHNESS
	float diffuseRoughnessFactor = diffuseRoughness;
	#ifdef USE_DIFFUSE_ROUGHNESSMAP
		diffuseRoughnessFactor *= texture2D( diffuseRoughnessMap, vDiffuseRoughnessMapUv ).r;
	#endif
	material.diffuseRoughness = saturate( diffuseRoughnessFactor );
#endif
#ifdef IOR
	material.ior = ior;
	#ifdef USE_SPECULAR
		float specularIntensityFactor = specularIntensity;
		vec3 specularColorFactor = specularColor;
		#ifdef USE_SPECULAR_COLORMAP
			specularColorFactor *= texture2D( specularColorMap, vSpecularColorMapUv ).rgb;
		#endif
		#ifdef USE_SPECULAR_INTENSITYMAP
			specularIntensityFactor *= texture2D( specularIntensityMap, vSpecularIntensityMapUv ).a;
		#endif
		material.specularF90 = mix( specularIntensityFactor, 1.0, metalnessFactor );
	#else
		float specularIntensityFactor = 1.0;
		vec3 specularColorFactor = vec3( 1.0 );
		material.specularF90 = 1.0;
	#endif
	material.specularColor = min( pow2( ( material.ior - 1.0 ) / ( material.ior + 1.0 ) ) * specularColorFactor, vec3( 1.0 ) ) * specularIntensityFactor;
	material.specularColorBlended = mix( material.specularColor, diffuseColor.rgb, metalnessFactor );
#else
	material.specularColor = vec3( 0.04 );
	material.specularColorBlended = mix( material.specularColor, diffuseColor.rgb, metalnessFactor );
	material.specularF90 = 1.0;
#endif
#ifdef USE_CLEARCOAT
	material.clearcoat = clearcoat;
	material.clearcoatRoughness = clearcoatRoughness;
	material.clearcoatF0 = vec3( 0.04 );
	material.clearcoatF90 = 1.0;
	#ifdef USE_CLEARCOATMAP
		material.clearcoat *= texture2D( clearcoatMap, vClearcoatMapUv ).x;
	#endif
	#ifdef USE_CLEARCOAT_ROUGHNESSMAP
		material.clearcoatRoughness *= texture2D( clearcoatRoughnessMap, vClearcoatRoughnessMapUv ).y;
	#endif
	material.clearcoat = saturate( material.clearcoat );	material.clearcoatRoughness = max( material.clearcoatRoughness, 0.045 );
	material.clearcoatRoughness += geometryRoughness;
	material.clearcoatRoughness = min( material.clearcoatRoughness, 1.0 );
#endif
#ifdef USE_DISPERSION
	material.dispersion = dispersion;
#endif
#ifdef USE_RETROREFLECTION
	material.retroreflectivity = retroreflectivity;
#endif
#ifdef USE_IRIDESCENCE
	material.iridescence = iridescence;
	material.iridescenceIOR = iridescenceIOR;
	#ifdef USE_IRIDESCENCEMAP
		material.iridescence *= texture2D( iridescenceMap, vIridescenceMapUv ).r;
	#endif
	#ifdef USE_IRIDESCENCE_THICKNESSMAP
		material.iridescenceThickness = (iridescenceThicknessMaximum - iridescenceThicknessMinimum) * texture2D( iridescenceThicknessMap, vIridescenceThicknessMapUv ).g + iridescenceThicknessMinimum;
	#else
		material.iridescenceThickness = iridescenceThicknessMaximum;
	#endif
#endif
#ifdef USE_SHEEN
	material.sheenColor = sheenColor;
	#ifdef USE_SHEEN_COLORMAP
		material.sheenColor *= texture2D( sheenColorMap, vSheenColorMapUv ).rgb;
	#endif
	material.sheenRoughness = clamp( sheenRoughness, 0.0001, 1.0 );
	#ifdef USE_SHEEN_ROUGHNESSMAP
		material.sheenRoughness *= texture2D( sheenRoughnessMap, vSheenRoughnessMapUv ).a;
	#endif
#endif
#ifdef USE_ANISOTROPY
	#ifdef USE_ANISOTROPYMAP
		mat2 anisotropyMat = mat2( anisotropyVector.x, anisotropyVector.y, - anisotropyVector.y, anisotropyVector.x );
		vec3 anisotropyPolar = texture2D( anisotropyMap, vAnisotropyMapUv ).rgb;
		vec2 anisotropyV = anisotropyMat * normalize( 2.0 * anisotropyPolar.rg - vec2( 1.0 ) ) * anisotropyPolar.b;
	#else
		vec2 anisotropyV = anisotropyVector;
	#endif
	material.anisotropy = length( anisotropyV );
	if( material.anisotropy == 0.0 ) {
		anisotropyV = vec2( 1.0, 0.0 );
	} else {
		anisotropyV /= material.anisotropy;
		material.anisotropy = saturate( material.anisotropy );
	}
	material.alphaT = mix( pow2( material.roughness ), 1.0, pow2( material.anisotropy ) );
	material.anisotropyT = tbn[ 0 ] * anisotropyV.x + tbn[ 1 ] * anisotropyV.y;
	material.anisotropyB = tbn[ 1 ] * anisotropyV.x - tbn[ 0 ] * anisotropyV.y;
#endif`,z_=`uniform sampler2D dfgLUT;
struct PhysicalMaterial {
	vec3 diffuseColor;
	vec3 diffuseContribution;
	vec3 specularColor;
	vec3 specularColorBlended;
	float roughness;
	float metalness;
	float specularF90;
	float dispersion;
	vec2 dfg;
	vec3 multiScatteringCompensation;
	#ifdef USE_DIFFUSE_ROUGHNESS
		float diffuseRoughness;
	#endif
	#ifdef USE_RETROREFLECTION
		float retroreflectivity;
	#endif
	#ifdef USE_CLEARCOAT
		float clearcoat;
		float clearcoatRoughness;
		vec3 clearcoatF0;
		float clearcoatF90;
	#endif
	#ifdef USE_IRIDESCENCE
		float iridescence;
		float iridescenceIOR;
		float iridescenceThickness;
		vec3 iridescenceFresnel;
		vec3 iridescenceF0Dielectric;
		vec3 iridescenceF0Metallic;
	#endif
	#ifdef USE_SHEEN
		vec3 sheenColor;
		float sheenRoughness;
	#endif
	#ifdef IOR
		float ior;
	#endif
	#ifdef USE_TRANSMISSION
		float transmission;
		float transmissionAlpha;
		float thickness;
		float attenuationDistance;
		vec3 attenuationColor;
	#endif
	#ifdef USE_ANISOTROPY
		float anisotropy;
		float alphaT;
		vec3 anisotropyT;
		vec3 anisotropyB;
	#endif
};
vec3 clearcoatSpecularDirect = vec3( 0.0 );
vec3 clearcoatSpecularIndirect = vec3( 0.0 );
vec3 sheenSpecularDirect = vec3( 0.0 );
vec3 sheenSpecularIndirect = vec3(0.0 );
vec3 Schlick_to_F0( const in vec3 f, const in float f90, const in float dotVH ) {
    float x = clamp( 1.0 - dotVH, 0.0, 1.0 );
    float x2 = x * x;
    float x5 = clamp( x * x2 * x2, 0.0, 0.9999 );
    return ( f - vec3( f90 ) * x5 ) / ( 1.0 - x5 );
}
#ifdef USE_DIFFUSE_ROUGHNESS
	const float EON_EPSILON = 1e-7;
	float FON_DirectionalAlbedo( const in float mu, const in float roughness, const in float A ) {
		float muComp = 1.0 - mu;
		float gOverPi = muComp * ( 0.0571085289 + muComp * ( 0.491881867 + muComp * ( - 0.332181442 + muComp * 0.0714429953 ) ) );
		return A * ( 1.0 + roughness * gOverPi );
	}
	vec3 BRDF_EON( const in vec3 lightDir, const in vec3 viewDir, const in vec3 normal, const in vec3 diffuseColor, const in float roughness ) {
		vec3 rho = saturate( diffuseColor );
		if ( roughness <= EON_EPSILON ) return BRDF_Lambert( rho );
		float dotNL = saturate( dot( normal, lightDir ) );
		float dotNV = saturate( dot( normal, viewDir ) );
		float s = dot( lightDir, viewDir ) - dotNL * dotNV;
		float sOverT = ( s > 0.0 ) ? s / max( max( dotNL, dotNV ), EON_EPSILON ) : s;
		float A = 1.0 / ( 1.0 + ( 0.5 - 2.0 / ( 3.0 * PI ) ) * roughness );
		vec3 singleScatter = rho * RECIPROCAL_PI * A * ( 1.0 + roughness * sOverT );
		float averageAlbedo = A * ( 1.0 + ( 2.0 / 3.0 - 28.0 / ( 15.0 * PI ) ) * roughness );
		float albedoV = FON_DirectionalAlbedo( dotNV, roughness, A );
		float albedoL = FON_DirectionalAlbedo( dotNL, roughness, A );
		vec3 rhoMultiScatter = rho * rho * averageAlbedo / max( vec3( EON_EPSILON ), vec3( 1.0 ) - rho * ( 1.0 - averageAlbedo ) );
		vec3 multiScatter = rhoMultiScatter * RECIPROCAL_PI
			* max( EON_EPSILON, 1.0 - albedoV )
			* max( EON_EPSILON, 1.0 - albedoL )
			/ max( EON_EPSILON, 1.0 - averageAlbedo );
		return singleScatter + multiScatter;
	}
	vec3 EON_DirectionalAlbedo( const in vec3 diffuseColor, const in float roughness, const in float dotNV ) {
		vec3 rho = saturate( diffuseColor );
		if ( roughness <= EON_EPSILON ) return rho;
		float A = 1.0 / ( 1.0 + ( 0.5 - 2.0 / ( 3.0 * PI ) ) * roughness );
		float directionalAlbedo = FON_DirectionalAlbedo( dotNV, roughness, A );
		float averageAlbedo = A * ( 1.0 + ( 2.0 / 3.0 - 28.0 / ( 15.0 * PI ) ) * roughness );
		vec3 rhoMultiScatter = rho * rho * averageAlbedo / max( vec3( EON_EPSILON ), vec3( 1.0 ) - rho * ( 1.0 - averageAlbedo ) );
		return rho * directionalAlbedo + rhoMultiScatter * ( 1.0 - directionalAlbedo );
	}
#endif
float V_GGX_SmithCorrelated( const in float alpha, const in float dotNL, const in float dotNV ) {
	float a2 = pow2( alpha );
	float gv = dotNL * sqrt( a2 + ( 1.0 - a2 ) * pow2( dotNV ) );
	float gl = dotNV * sqrt( a2 + ( 1.0 - a2 ) * pow2( dotNL ) );
	return 0.5 / max( gv + gl, EPSILON );
}
float D_GGX( const in float alpha, const in float dotNH ) {
	float a2 = pow2( alpha );
	float denom = pow2( dotNH ) * ( a2 - 1.0 ) + 1.0;
	return RECIPROCAL_PI * a2 / pow2( denom );
}
#ifdef USE_ANISOTROPY
	float V_GGX_SmithCorrelated_Anisotropic( const in float alphaT, const in float alphaB, const in float dotTV, const in float dotBV, const in float dotTL, const in float dotBL, const in float dotNV, const in float dotNL ) {
		float gv = dotNL * length( vec3( alphaT * dotTV, alphaB * dotBV, dotNV ) );
		float gl = dotNV * length( vec3( alphaT * dotTL, alphaB * dotBL, dotNL ) );
		return 0.5 / max( gv + gl, EPSILON );
	}
	float D_GGX_Anisotropic( const in float alphaT, const in float alphaB, const in float dotNH, const in float dotTH, const in float dotBH ) {
		float a2 = alphaT * alphaB;
		highp vec3 v = vec3( alphaB * dotTH, alphaT * dotBH, a2 * dotNH );
		highp float v2 = dot( v, v );
		float w2 = a2 / v2;
		return RECIPROCAL_PI * a2 * pow2 ( w2 );
	}
#endif
#ifdef USE_CLEARCOAT
	vec3 BRDF_GGX_Clearcoat( const in vec3 lightDir, const in vec3 viewDir, const in vec3 normal, const in PhysicalMaterial material) {
		vec3 f0 = material.clearcoatF0;
		float f90 = material.clearcoatF90;
		float roughness = max( material.clearcoatRoughness, 0.045 );
		float alpha = pow2( roughness );
		vec3 halfDir = normalize( lightDir + viewDir );
		float dotNL = saturate( dot( normal, lightDir ) );
		float dotNV = saturate( dot( normal, viewDir ) );
		float dotNH = saturate( dot( normal, halfDir ) );
		float dotVH = saturate( dot( viewDir, halfDir ) );
		vec3 F = F_Schlick( f0, f90, dotVH );
		float V = V_GGX_SmithCorrelated( alpha, dotNL, dotNV );
		float D = D_GGX( alpha, dotNH );
		return F * ( V * D );
	}
#endif
vec3 BRDF_GGX( const in vec3 lightDir, const in vec3 viewDir, const in vec3 normal, const in PhysicalMaterial material ) {
	vec3 f0 = material.specularColorBlended;
	float f90 = material.specularF90;
	float roughness = max( material.roughness, 0.045 );
	float alpha = pow2( roughness );
	vec3 halfDir = normalize( lightDir + viewDir );
	float dotNL = saturate( dot( normal, lightDir ) );
	float dotNV = saturate( dot( normal, viewDir ) );
	float dotNH = saturate( dot( normal, halfDir ) );
	float dotVH = saturate( dot( viewDir, halfDir ) );
	vec3 F = F_Schlick( f0, f90, dotVH );
	#ifdef USE_IRIDESCENCE
		F = mix( F, material.iridescenceFresnel, material.iridescence );
	#endif
	#ifdef USE_ANISOTROPY
		float dotTL = dot( material.anisotropyT, lightDir );
		float dotTV = dot( material.anisotropyT, viewDir );
		float dotTH = dot( material.anisotropyT, halfDir );
		float dotBL = dot( material.anisotropyB, lightDir );
		float dotBV = dot( material.anisotropyB, viewDir );
		float dotBH = dot( material.anisotropyB, halfDir );
		float alphaT = max( material.alphaT, alpha );
		float V = V_GGX_SmithCorrelated_Anisotropic( alphaT, alpha, dotTV, dotBV, dotTL, dotBL, dotNV, dotNL );
		float D = D_GGX_Anisotropic( alphaT, alpha, dotNH, dotTH, dotBH );
	#else
		float V = V_GGX_SmithCorrelated( alpha, dotNL, dotNV );
		float D = D_GGX( alpha, dotNH );
	#endif
	return F * ( V * D );
}
vec2 LTC_Uv( const in vec3 N, const in vec3 V, const in float roughness ) {
	const float LUT_SIZE = 64.0;
	const float LUT_SCALE = ( LUT_SIZE - 1.0 ) / LUT_SIZE;
	const float LUT_BIAS = 0.5 / LUT_SIZE;
	float dotNV = saturate( dot( N, V ) );
	vec2 uv = vec2( roughness, sqrt( 1.0 - dotNV ) );
	uv = uv * LUT_SCALE + LUT_BIAS;
	return uv;
}
float LTC_ClippedSphereFormFactor( const in vec3 f ) {
	float l = length( f );
	return max( ( l * l + f.z ) / ( l + 1.0 ), 0.0 );
}
vec3 LTC_EdgeVectorFormFactor( const in vec3 v1, const in vec3 v2 ) {
	float x = dot( v1, v2 );
	float y = abs( x );
	float a = 0.8543985 + ( 0.4965155 + 0.0145206 * y ) * y;
	float b = 3.4175940 + ( 4.1616724 + y ) * y;
	float v = a / b;
	float theta_sintheta = ( x > 0.0 ) ? v : 0.5 * inversesqrt( max( 1.0 - x * x, 1e-7 ) ) - v;
	return cross( v1, v2 ) * theta_sintheta;
}
vec3 LTC_Evaluate( const in vec3 N, const in vec3 V, const in vec3 P, const in mat3 mInv, const in vec3 rectCoords[ 4 ] ) {
	vec3 v1 = rectCoords[ 1 ] - rectCoords[ 0 ];
	vec3 v2 = rectCoords[ 3 ] - rectCoords[ 0 ];
	vec3 lightNormal = cross( v1, v2 );
	if( dot( lightNormal, P - rectCoords[ 0 ] ) < 0.0 ) return vec3( 0.0 );
	vec3 T1, T2;
	T1 = normalize( V - N * dot( V, N ) );
	T2 = - cross( N, T1 );
	mat3 mat = mInv * transpose( mat3( T1, T2, N ) );
	vec3 coords[ 4 ];
	coords[ 0 ] = mat * ( rectCoords[ 0 ] - P );
	coords[ 1 ] = mat * ( rectCoords[ 1 ] - P );
	coords[ 2 ] = mat * ( rectCoords[ 2 ] - P );
	coords[ 3 ] = mat * ( rectCoords[ 3 ] - P );
	coords[ 0 ] = normalize( coords[ 0 ] );
	coords[ 1 ] = normalize( coords[ 1 ] );
	coords[ 2 ] = normalize( coords[ 2 ] );
	coords[ 3 ] = normalize( coords[ 3 ] );
	vec3 vectorFormFactor = vec3( 0.0 );
	vectorFormFactor += LTC_EdgeVectorFormFactor( coords[ 0 ], coords[ 1 ] );
	vectorFormFactor += LTC_EdgeVectorFormFactor( coords[ 1 ], coords[ 2 ] );
	vectorFormFactor += LTC_EdgeVectorFormFactor( coords[ 2 ], coords[ 3 ] );
	vectorFormFactor += LTC_EdgeVectorFormFactor( coords[ 3 ], coords[ 0 ] );
	float result = LTC_ClippedSphereFormFactor( vectorFormFactor );
	return vec3( result );
}
#if defined( USE_SHEEN )
float D_Charlie( float roughness, float dotNH ) {
	float alpha = pow2( roughness );
	float invAlpha = 1.0 / alpha;
	float cos2h = dotNH * dotNH;
	float sin2h = max( 1.0 - cos2h, 0.0078125 );
	return ( 2.0 + invAlpha ) * pow( sin2h, invAlpha * 0.5 ) / ( 2.0 * PI );
}
float V_Neubelt( float dotNV, float dotNL ) {
	return saturate( 1.0 / ( 4.0 * ( dotNL + dotNV - dotNL * dotNV ) ) );
}
vec3 BRDF_Sheen( const in vec3 lightDir, const in vec3 viewDir, const in vec3 normal, vec3 sheenColor, const in float sheenRoughness ) {
	vec3 halfDir = normalize( lightDir + viewDir );
	float dotNL = saturate( dot( normal, lightDir ) );
	float dotNV = saturate( dot( normal, viewDir ) );
	float dotNH = saturate( dot( normal, halfDir ) );
	float D = D_Charlie( sheenRoughness, dotNH );
	float V = V_Neubelt( dotNV, dotNL );
	return sheenColor * ( D * V );
}
#endif
float IBLSheenBRDF( const in vec3 normal, const in vec3 viewDir, const in float roughness ) {
	float dotNV = saturate( dot( normal, viewDir ) );
	float r2 = roughness * roughness;
	float rInv = 1.0 / ( roughness + 0.1 );
	float a = -1.9362 + 1.0678 * roughness + 0.4573 * r2 - 0.8469 * rInv;
	float b = -0.6014 + 0.5538 * roughness - 0.4670 * r2 - 0.1255 * rInv;
	float DG = exp( a * dotNV + b );
	return saturate( DG );
}
vec3 EnvironmentBRDF( const in vec3 normal, const in vec3 viewDir, const in vec3 specularColor, const in float specularF90, const in float roughness ) {
	float dotNV = saturate( dot( normal, viewDir ) );
	vec2 fab = texture2D( dfgLUT, vec2( roughness, dotNV ) ).rg;
	return specularColor * fab.x + specularF90 * fab.y;
}
#ifdef USE_IRIDESCENCE
void computeMultiscatteringIridescence( const in vec2 fab, const in vec3 specularColor, const in float specularF90, const in float iridescence, const in vec3 iridescenceF0, inout vec3 singleScatter, inout vec3 multiScatter ) {
#else
void computeMultiscattering( const in vec2 fab, const in vec3 specularColor, const in float specularF90, inout vec3 singleScatter, inout vec3 multiScatter ) {
#endif
	#ifdef USE_IRIDESCENCE
		vec3 Fr = mix( specularColor, iridescenceF0, iridescence );
	#else
		vec3 Fr = specularColor;
	#endif
	vec3 FssEss = Fr * fab.x + specularF90 * fab.y;
	float Ess = fab.x + fab.y;
	float Ems = 1.0 - Ess;
	vec3 Favg = Fr + ( 1.0 - Fr ) * 0.047619;	vec3 Fms = FssEss * Favg / ( 1.0 - Ems * Favg );
	singleScatter += FssEss;
	multiScatter += Fms * Ems;
}
#if NUM_RECT_AREA_LIGHTS > 0
	void RE_Direct_RectArea_Physical( const in RectAreaLight rectAreaLight, const in vec3 geometryPosition, const in vec3 geometryNormal, const in vec3 geometryViewDir, const in vec3 geometryClearcoatNormal, const in PhysicalMaterial material, inout ReflectedLight reflectedLight ) {
		vec3 normal = geometryNormal;
		vec3 viewDir = geometryViewDir;
		vec3 position = geometryPosition;
		vec3 lightPos = rectAreaLight.position;
		vec3 halfWidth = rectAreaLight.halfWidth;
		vec3 halfHeight = rectAreaLight.halfHeight;
		vec3 lightColor = rectAreaLight.color;
		float roughness = material.roughness;
		vec3 rectCoords[ 4 ];
		rectCoords[ 0 ] = lightPos + halfWidth - halfHeight;		rectCoords[ 1 ] = lightPos - halfWidth - halfHeight;
		rectCoords[ 2 ] = lightPos - halfWidth + halfHeight;
		rectCoords[ 3 ] = lightPos + halfWidth + halfHeight;
		vec2 uv = LTC_Uv( normal, viewDir, roughness );
		vec4 t1 = texture2D( ltc_1, uv );
		vec4 t2 = texture2D( ltc_2, uv );
		mat3 mInv = mat3(
			vec3( t1.x, 0, t1.y ),
			vec3(    0, 1,    0 ),
			vec3( t1.z, 0, t1.w )
		);
		vec3 fresnel = ( material.specularColorBlended * t2.x + ( material.specularF90 - material.specularColorBlended ) * t2.y );
		reflectedLight.directSpecular += lightColor * fresnel * LTC_Evaluate( normal, viewDir, position, mInv, rectCoords );
		reflectedLight.directDiffuse += lightColor * material.diffuseContribution * LTC_Evaluate( normal, viewDir, position, mat3( 1.0 ), rectCoords );
		#ifdef USE_CLEARCOAT
			vec3 Ncc = geometryClearcoatNormal;
			vec2 uvClearcoat = LTC_Uv( Ncc, viewDir, material.clearcoatRoughness );
			vec4 t1Clearcoat = texture2D( ltc_1, uvClearcoat );
			vec4 t2Clearcoat = texture2D( ltc_2, uvClearcoat );
			mat3 mInvClearcoat = mat3(
				vec3( t1Clearcoat.x, 0, t1Clearcoat.y ),
				vec3(             0, 1,             0 ),
				vec3( t1Clearcoat.z, 0, t1Clearcoat.w )
			);
			vec3 fresnelClearcoat = material.clearcoatF0 * t2Clearcoat.x + ( material.clearcoatF90 - material.clearcoatF0 ) * t2Clearcoat.y;
			clearcoatSpecularDirect += lightColor * fresnelClearcoat * LTC_Evaluate( Ncc, viewDir, position, mInvClearcoat, rectCoords );
		#endif
	}
#endif
void RE_Direct_Physical( const in IncidentLight directLight, const in vec3 geometryPosition, const in vec3 geometryNormal, const in vec3 geometryViewDir, const in vec3 geometryClearcoatNormal, const in PhysicalMaterial material, inout ReflectedLight reflectedLight ) {
	float dotNL = saturate( dot( geometryNormal, directLight.direction ) );
	vec3 irradiance = dotNL * directLight.color;
	#ifdef USE_CLEARCOAT
		float dotNLcc = saturate( dot( geometryClearcoatNormal, directLight.direction ) );
		vec3 ccIrradiance = dotNLcc * directLight.color;
		clearcoatSpecularDirect += ccIrradiance * BRDF_GGX_Clearcoat( directLight.direction, geometryViewDir, geometryClearcoatNormal, material );
	#endif
	#ifdef USE_SHEEN
 
 		sheenSpecularDirect += irradiance * BRDF_Sheen( directLight.direction, geometryViewDir, geometryNormal, material.sheenColor, material.sheenRoughness );
 
 		float sheenAlbedoV = IBLSheenBRDF( geometryNormal, geometryViewDir, material.sheenRoughness );
 		float sheenAlbedoL = IBLSheenBRDF( geometryNormal, directLight.direction, material.sheenRoughness );
 
 		float sheenEnergyComp = 1.0 - max3( material.sheenColor ) * max( sheenAlbedoV, sheenAlbedoL );
 
 		irradiance *= sheenEnergyComp;
 
 	#endif
	vec3 specularBRDF = BRDF_GGX( directLight.direction, geometryViewDir, geometryNormal, material );
	#ifdef USE_RETROREFLECTION
		vec3 retroViewDir = reflect( - geometryViewDir, geometryNormal );
		vec3 retroSpecularBRDF = BRDF_GGX( directLight.direction, retroViewDir, geometryNormal, material );
		specularBRDF = mix( specularBRDF, retroSpecularBRDF, saturate( material.retroreflectivity ) );
	#endif
	reflectedLight.directSpecular += irradiance * specularBRDF * material.multiScatteringCompensation;
	vec3 halfDir = normalize( directLight.direction + geometryViewDir );
	float dotVH = saturate( dot( geometryViewDir, halfDir ) );
	vec3 F = F_Schlick( material.specularColor, material.specularF90, dotVH );
	#ifdef USE_RETROREFLECTION
		vec3 retroHalfDir = normalize( directLight.direction + retroViewDir );
		float dotRetroVH = saturate( dot( retroViewDir, retroHalfDir ) );
		vec3 retroF = F_Schlick( material.specularColor, material.specularF90, dotRetroVH );
		F = mix( F, retroF, saturate( material.retroreflectivity ) );
	#endif
	#ifdef USE_DIFFUSE_ROUGHNESS
		vec3 diffuseBRDF = BRDF_EON( directLight.direction, geometryViewDir, geometryNormal, material.diffuseColor, material.diffuseRoughness ) * ( 1.0 - material.metalness );
	#else
		vec3 diffuseBRDF = BRDF_Lambert( material.diffuseContribution );
	#endif
	reflectedLight.directDiffuse += irradiance * diffuseBRDF * ( 1.0 - F );
}
void RE_IndirectDiffuse_Physical( const in vec3 irradiance, const in vec3 geometryPosition, const in vec3 geometryNormal, const in vec3 geometryViewDir, const in vec3 geometryClearcoatNormal, const in PhysicalMaterial material, inout ReflectedLight reflectedLight ) {
	vec3 singleScattering = vec3( 0.0 );
	vec3 multiScattering = vec3( 0.0 );
	#ifdef USE_IRIDESCENCE
		computeMultiscatteringIridescence( material.dfg, material.specularColor, material.specularF90, material.iridescence, material.iridescenceF0Dielectric, singleScattering, multiScattering );
	#else
		computeMultiscattering( material.dfg, material.specularColor, material.specularF90, singleScattering, multiScattering );
	#endif
	#ifdef USE_DIFFUSE_ROUGHNESS
		float dotNV = saturate( dot( geometryNormal, geometryViewDir ) );
		vec3 diffuseAlbedo = EON_DirectionalAlbedo( material.diffuseColor, material.diffuseRoughness, dotNV ) * ( 1.0 - material.metalness );
		vec3 diffuse = irradiance * RECIPROCAL_PI * diffuseAlbedo * ( 1.0 - singleScattering - multiScattering );
	#else
		vec3 diffuse = irradiance * BRDF_Lambert( material.diffuseContribution ) * ( 1.0 - singleScattering - multiScattering );
	#endif
	#ifdef USE_SHEEN
		float sheenAlbedo = IBLSheenBRDF( geometryNormal, geometryViewDir, material.sheenRoughness );
		sheenSpecularIndirect += irradiance * material.sheenColor * sheenAlbedo * RECIPROCAL_PI;
		float sheenEnergyComp = 1.0 - max3( material.sheenColor ) * sheenAlbedo;
		diffuse *= sheenEnergyComp;
	#endif
	reflectedLight.indirectDiffuse += diffuse;
}
void RE_IndirectSpecular_Physical( const in vec3 radiance, const in vec3 irradiance, const in vec3 clearcoatRadiance, const in vec3 geometryPosition, const in vec3 geometryNormal, const in vec3 geometryViewDir, const in vec3 geometryClearcoatNormal, const in PhysicalMaterial material, inout ReflectedLight reflectedLight) {
	#ifdef USE_CLEARCOAT
		clearcoatSpecularIndirect += clearcoatRadiance * EnvironmentBRDF( geometryClearcoatNormal, geometryViewDir, material.clearcoatF0, material.clearcoatF90, material.clearcoatRoughness );
	#endif
	#ifdef USE_SHEEN
		sheenSpecularIndirect += irradiance * material.sheenColor * IBLSheenBRDF( geometryNormal, geometryViewDir, material.sheenRoughness ) * RECIPROCAL_PI;
 	#endif
	vec3 singleScatteringDielectric = vec3( 0.0 );
	vec3 multiScatteringDielectric = vec3( 0.0 );
	vec3 singleScatteringMetallic = vec3( 0.0 );
	vec3 multiScatteringMetallic = vec3( 0.0 );
	#ifdef USE_IRIDESCENCE
		computeMultiscatteringIridescence( material.dfg, material.specularColor, material.specularF90, material.iridescence, material.iridescenceF0Dielectric, singleScatteringDielectric, multiScatteringDielectric );
		computeMultiscatteringIridescence( material.dfg, material.diffuseColor, material.specularF90, material.iridescence, material.iridescenceF0Metallic, singleScatteringMetallic, multiScatteringMetallic );
	#else
		computeMultiscattering( material.dfg, material.specularColor, material.specularF90, singleScatteringDielectric, multiScatteringDielectric );
		computeMultiscattering( material.dfg, material.diffuseColor, material.specularF90, singleScatteringMetallic, multiScatteringMetallic );
	#endif
	vec3 singleScattering = mix( singleScatteringDielectric, singleScatteringMetallic, material.metalness );
	vec3 multiScattering = mix( multiScatteringDielectric, multiScatteringMetallic, material.metalness );
	vec3 totalScatteringDielectric = singleScatteringDielectric + multiScatteringDielectric;
	#ifdef USE_DIFFUSE_ROUGHNESS
		float dotNV = saturate( dot( geometryNormal, geometryViewDir ) );
		vec3 diffuse = EON_DirectionalAlbedo( material.diffuseColor, material.diffuseRoughness, dotNV ) * ( 1.0 - material.metalness ) * ( 1.0 - totalScatteringDielectric );
	#else
		vec3 diffuse = material.diffuseContribution * ( 1.0 - totalScatteringDielectric );
	#endif
	vec3 cosineWeightedIrradiance = irradiance * RECIPROCAL_PI;
	vec3 indirectSpecular = radiance * singleScattering;
	indirectSpecular += multiScattering * cosineWeightedIrradiance;
	vec3 indirectDiffuse = diffuse * cosineWeightedIrradiance;
	#ifdef USE_SHEEN
		float sheenAlbedo = IBLSheenBRDF( geometryNormal, geometryViewDir, material.sheenRoughness );
		float sheenEnergyComp = 1.0 - max3( material.sheenColor ) * sheenAlbedo;
		indirectSpecular *= sheenEnergyComp;
		indirectDiffuse *= sheenEnergyComp;
	#endif
	reflectedLight.indirectSpecular += indirectSpecular;
	reflectedLight.indirectDiffuse += indirectDiffuse;
}
#define RE_Direct				RE_Direct_Physical
#define RE_Direct_RectArea		RE_Direct_RectArea_Physical
#define RE_IndirectDiffuse		RE_IndirectDiffuse_Physical
#define RE_IndirectSpecular		RE_IndirectSpecular_Physical
float computeSpecularOcclusion( const in float dotNV, const in float ambientOcclusion, const in float roughness ) {
	return saturate( pow( dotNV + ambientOcclusion, exp2( - 16.0 * roughness - 1.0 ) ) - 1.0 + ambientOcclusion );
}`,V_=`
vec3 geometryPosition = - vViewPosition;
vec3 geometryNormal = normal;
vec3 geometryViewDir = ( isOrthographic ) ? vec3( 0, 0, 1 ) : normalize( vViewPosition );
vec3 geometryClearcoatNormal = vec3( 0.0 );
#ifdef USE_CLEARCOAT
	geometryClearcoatNormal = clearcoatNormal;
#endif
#ifdef USE_IRIDESCENCE
	float dotNVi = saturate( dot( normal, geometryViewDir ) );
	if ( material.iridescenceThickness == 0.0 ) {
		material.iridescence = 0.0;
	} else {
		material.iridescence = saturate( material.iridescence );
	}
	if ( material.iridescence > 0.0 ) {
		vec3 iridescenceFresnelDielectric = evalIridescence( 1.0, material.iridescenceIOR, dotNVi, material.iridescenceThickness, material.specularColor );
		vec3 iridescenceFresnelMetallic = evalIridescence( 1.0, material.iridescenceIOR, dotNVi, material.iridescenceThickness, material.diffuseColor );
		material.iridescenceFresnel = mix( iridescenceFresnelDielectric, iridescenceFresnelMetallic, material.metalness );
		material.iridescenceF0Dielectric = Schlick_to_F0( iridescenceFresnelDielectric, 1.0, dotNVi );
		material.iridescenceF0Metallic = Schlick_to_F0( iridescenceFresnelMetallic, 1.0, dotNVi );
	}
#endif
#ifdef STANDARD
	float dotNVms = saturate( dot( geometryNormal, geometryViewDir ) );
	material.dfg = texture2D( dfgLUT, vec2( material.roughness, dotNVms ) ).rg;
	#if ( NUM_SUN_LIGHTS > 0 || NUM_DIR_LIGHTS > 0 || NUM_POINT_LIGHTS > 0 || NUM_SPOT_LIGHTS > 0 )
		float EssMs = material.dfg.x + material.dfg.y;
		material.multiScatteringCompensation = 1.0 + material.specularColorBlended * ( 1.0 / EssMs - 1.0 );
	#endif
#endif
IncidentLight directLight;
#if ( NUM_POINT_LIGHTS > 0 ) && defined( RE_Direct )
	PointLight pointLight;
	#if defined( USE_SHADOWMAP ) && NUM_POINT_LIGHT_SHADOWS > 0
	PointLightShadow pointLightShadow;
	#endif
	#pragma unroll_loop_start
	for ( int i = 0; i < NUM_POINT_LIGHTS; i ++ ) {
		pointLight = pointLights[ i ];
		getPointLightInfo( pointLight, geometryPosition, directLight );
		#if defined( USE_SHADOWMAP ) && ( UNROLLED_LOOP_INDEX < NUM_POINT_LIGHT_SHADOWS ) && ( defined( SHADOWMAP_TYPE_PCF ) || defined( SHADOWMAP_TYPE_BASIC ) )
		pointLightShadow = pointLightShadows[ i ];
		directLight.color *= ( directLight.visible && receiveShadow ) ? getPointShadow( pointShadowMap[ i ], pointLightShadow.shadowMapSize, pointLightShadow.shadowIntensity, pointLightShadow.shadowBias, pointLightShadow.shadowRadius, vPointShadowCoord[ i ], pointLightShadow.shadowCameraNear, pointLightShadow.shadowCameraFar ) : 1.0;
		#endif
		RE_Direct( directLight, geometryPosition, geometryNormal, geometryViewDir, geometryClearcoatNormal, material, reflectedLight );
	}
	#pragma unroll_loop_end
#endif
#if ( NUM_SPOT_LIGHTS > 0 ) && defined( RE_Direct )
	SpotLight spotLight;
	vec4 spotColor;
	vec3 spotLightCoord;
	bool inSpotLightMap;
	#if defined( USE_SHADOWMAP ) && NUM_SPOT_LIGHT_SHADOWS > 0
	SpotLightShadow spotLightShadow;
	#endif
	#pragma unroll_loop_start
	for ( int i = 0; i < NUM_SPOT_LIGHTS; i ++ ) {
		spotLight = spotLights[ i ];
		getSpotLightInfo( spotLight, geometryPosition, directLight );
		#if ( UNROLLED_LOOP_INDEX < NUM_SPOT_LIGHT_SHADOWS_WITH_MAPS )
		#define SPOT_LIGHT_MAP_INDEX UNROLLED_LOOP_INDEX
		#elif ( UNROLLED_LOOP_INDEX < NUM_SPOT_LIGHT_SHADOWS )
		#define SPOT_LIGHT_MAP_INDEX NUM_SPOT_LIGHT_MAPS
		#else
		#define SPOT_LIGHT_MAP_INDEX ( UNROLLED_LOOP_INDEX - NUM_SPOT_LIGHT_SHADOWS + NUM_SPOT_LIGHT_SHADOWS_WITH_MAPS )
		#endif
		#if ( SPOT_LIGHT_MAP_INDEX < NUM_SPOT_LIGHT_MAPS )
			spotLightCoord = vSpotLightCoord[ i ].xyz / vSpotLightCoord[ i ].w;
			inSpotLightMap = all( lessThan( abs( spotLightCoord * 2. - 1. ), vec3( 1.0 ) ) );
			spotColor = texture2D( spotLightMap[ SPOT_LIGHT_MAP_INDEX ], spotLightCoord.xy );
			directLight.color = inSpotLightMap ? directLight.color * spotColor.rgb : directLight.color;
		#endif
		#undef SPOT_LIGHT_MAP_INDEX
		#if defined( USE_SHADOWMAP ) && ( UNROLLED_LOOP_INDEX < NUM_SPOT_LIGHT_SHADOWS )
		spotLightShadow = spotLightShadows[ i ];
		directLight.color *= ( directLight.visible && receiveShadow ) ? getShadow( spotShadowMap[ i ], spotLightShadow.shadowMapSize, spotLightShadow.shadowIntensity, spotLightShadow.shadowBias, spotLightShadow.shadowRadius, vSpotLightCoord[ i ] ) : 1.0;
		#endif
		RE_Direct( directLight, geometryPosition, geometryNormal, geometryViewDir, geometryClearcoatNormal, material, reflectedLight );
	}
	#pragma unroll_loop_end
#endif
#if ( NUM_SUN_LIGHTS > 0 ) && defined( RE_Direct )
	SunLight sunLight;
	#if defined( USE_SHADOWMAP ) && NUM_SUN_LIGHT_SHADOWS > 0
	SunLightShadow sunLightShadow;
	#endif
	#pragma unroll_loop_start
	for ( int i = 0; i < NUM_SUN_LIGHTS; i ++ ) {
		sunLight = sunLights[ i ];
		getSunLightInfo( sunLight, directLight );
		#if defined( USE_SHADOWMAP ) && ( UNROLLED_LOOP_INDEX < NUM_SUN_LIGHT_SHADOWS )
		sunLightShadow = sunLightShadows[ i ];
		directLight.color *= ( directLight.visible && receiveShadow ) ? getSunShadow( sunShadowMap[ i ], sunLightShadow, UNROLLED_LOOP_INDEX ) : 1.0;
		#endif
		RE_Direct( directLight, geometryPosition, geometryNormal, geometryViewDir, geometryClearcoatNormal, material, reflectedLight );
	}
	#pragma unroll_loop_end
#endif
#if ( NUM_DIR_LIGHTS > 0 ) && defined( RE_Direct )
	DirectionalLight directionalLight;
	#if defined( USE_SHADOWMAP ) && NUM_DIR_LIGHT_SHADOWS > 0
	DirectionalLightShadow directionalLightShadow;
	#endif
	#pragma unroll_loop_start
	for ( int i = 0; i < NUM_DIR_LIGHTS; i ++ ) {
		directionalLight = directionalLights[ i ];
		getDirectionalLightInfo( directionalLight, directLight );
		#if defined( USE_SHADOWMAP ) && ( UNROLLED_LOOP_INDEX < NUM_DIR_LIGHT_SHADOWS )
		directionalLightShadow = directionalLightShadows[ i ];
		directLight.color *= ( directLight.visible && receiveShadow ) ? getShadow( directionalShadowMap[ i ], directionalLightShadow.shadowMapSize, directionalLightShadow.shadowIntensity, directionalLightShadow.shadowBias, directionalLightShadow.shadowRadius, vDirectionalShadowCoord[ i ] ) : 1.0;
		#endif
		RE_Direct( directLight, geometryPosition, geometryNormal, geometryViewDir, geometryClearcoatNormal, material, reflectedLight );
	}
	#pragma unroll_loop_end
#endif
#if ( NUM_RECT_AREA_LIGHTS > 0 ) && defined( RE_Direct_RectArea )
	RectAreaLight rectAreaLight;
	#pragma unroll_loop_start
	for ( int i = 0; i < NUM_RECT_AREA_LIGHTS; i ++ ) {
		rectAreaLight = rectAreaLights[ i ];
		RE_Direct_RectArea( rectAreaLight, geometryPosition, geometryNormal, geometryViewDir, geometryClearcoatNormal, material, reflectedLight );
	}
	#pragma unroll_loop_end
#endif
#if defined( RE_IndirectDiffuse )
	vec3 iblIrradiance = vec3( 0.0 );
	vec3 irradiance = getAmbientLightIrradiance( ambientLightColor );
	#if defined( USE_LIGHT_PROBES )
		irradiance += getLightProbeIrradiance( lightProbe, geometryNormal );
	#endif
	#if ( NUM_HEMI_LIGHTS > 0 )
		#pragma unroll_loop_start
		for ( int i = 0; i < NUM_HEMI_LIGHTS; i ++ ) {
			irradiance += getHemisphereLightIrradiance( hemisphereLights[ i ], geometryNormal );
		}
		#pragma unroll_loop_end
	#endif
	#if NUM_LIGHT_PROBE_GRIDS > 0
		vec3 probeWorldPos = ( ( vec4( geometryPosition, 1.0 ) - viewMatrix[ 3 ] ) * viewMatrix ).xyz;
		vec3 probeWorldNormal = transformNormalByInverseViewMatrix( geometryNormal, viewMatrix );
		int probeGrid = - 1;
		#pragma unroll_loop_start
		for ( int i = 0; i < NUM_LIGHT_PROBE_GRIDS; i ++ ) {
			if ( isInsideLightProbeGrid( probeWorldPos, probeWorldNormal, probesMin[ i ], probesMax[ i ], probesResolution[ i ] ) ) probeGrid = UNROLLED_LOOP_INDEX;
		}
		#pragma unroll_loop_end
		#pragma unroll_loop_start
		for ( int i = 0; i < NUM_LIGHT_PROBE_GRIDS; i ++ ) {
			if ( probeGrid == UNROLLED_LOOP_INDEX ) irradiance += getLightProbeGridIrradiance( probesSH[ i ], probesMin[ i ], probesMax[ i ], probesResolution[ i ], probeWorldPos, probeWorldNormal );
		}
		#pragma unroll_loop_end
	#endif
#endif
#if defined( RE_IndirectSpecular )
	vec3 radiance = vec3( 0.0 );
	vec3 clearcoatRadiance = vec3( 0.0 );
#endif`,H_=`#if defined( RE_IndirectDiffuse )
	#ifdef USE_LIGHTMAP
		vec4 lightMapTexel = texture2D( lightMap, vLightMapUv );
		vec3 lightMapIrradiance = lightMapTexel.rgb * lightMapIntensity;
		irradiance += lightMapIrradiance;
	#endif
	#if defined( USE_ENVMAP ) && defined( ENVMAP_TYPE_PMREM )
		#if defined( STANDARD ) || defined( LAMBERT ) || defined( PHONG )
			iblIrradiance += getIBLIrradiance( geometryNormal );
		#endif
	#endif
#endif
#if defined( USE_ENVMAP ) && defined( RE_IndirectSpecular )
	#ifdef USE_ANISOTROPY
		vec3 iblRadiance = getIBLAnisotropyRadiance( geometryViewDir, geometryNormal, material.roughness, material.anisotropyB, material.anisotropy );
	#else
		vec3 iblRadiance = getIBLRadiance( geometryViewDir, geometryNormal, material.roughness );
	#endif
	#ifdef USE_RETROREFLECTION
		#ifdef USE_ANISOTROPY
			vec3 retroIBLRadiance = getIBLAnisotropyRetroRadiance( geometryViewDir, geometryNormal, material.roughness, material.anisotropyB, material.anisotropy );
		#else
			vec3 retroIBLRadiance = getIBLRetroRadiance( geometryViewDir, geometryNormal, material.roughness );
		#endif
		iblRadiance = mix( iblRadiance, retroIBLRadiance, saturate( material.retroreflectivity ) );
	#endif
	radiance += iblRadiance;
	#ifdef USE_CLEARCOAT
		clearcoatRadiance += getIBLRadiance( geometryViewDir, geometryClearcoatNormal, material.clearcoatRoughness );
	#endif
#endif`,G_=`#if defined( RE_IndirectDiffuse )
	#if defined( LAMBERT ) || defined( PHONG )
		irradiance += iblIrradiance;
	#endif
	RE_IndirectDiffuse( irradiance, geometryPosition, geometryNormal, geometryViewDir, geometryClearcoatNormal, material, reflectedLight );
#endif
#if defined( RE_IndirectSpecular )
	RE_IndirectSpecular( radiance, iblIrradiance, clearcoatRadiance, geometryPosition, geometryNormal, geometryViewDir, geometryClearcoatNormal, material, reflectedLight );
#endif`,W_=`#if NUM_LIGHT_PROBE_GRIDS > 0
uniform highp sampler3D probesSH[ NUM_LIGHT_PROBE_GRIDS ];
uniform vec3 probesMin[ NUM_LIGHT_PROBE_GRIDS ];
uniform vec3 probesMax[ NUM_LIGHT_PROBE_GRIDS ];
uniform vec3 probesResolution[ NUM_LIGHT_PROBE_GRIDS ];
bool isInsideLightProbeGrid( vec3 worldPos, vec3 worldNormal, vec3 probesMin, vec3 probesMax, vec3 probesResolution ) {
	vec3 spacing = ( probesMax - probesMin ) / probesResolution;
	vec3 samplePos = worldPos + worldNormal * spacing * 0.5;
	vec3 margin = spacing * 0.01;
	return all( greaterThanEqual( samplePos, probesMin - margin ) ) && all( lessThanEqual( samplePos, probesMax + margin ) );
}
vec3 getLightProbeGridIrradiance( highp sampler3D probesSH, vec3 probesMin, vec3 probesMax, vec3 probesResolution, vec3 worldPos, vec3 worldNormal ) {
	vec3 res = probesResolution;
	vec3 gridRange = probesMax - probesMin;
	vec3 probeSpacing = gridRange / res;
	vec3 samplePos = worldPos + worldNormal * probeSpacing * 0.5;
	vec3 uvw = clamp( ( samplePos - probesMin ) / gridRange, 0.5 / res, 1.0 - 0.5 / res );
	float nz          = res.z;
	float paddedSlices = nz + 2.0;
	float atlasDepth  = 7.0 * paddedSlices;
	float uvZBase     = uvw.z * nz + 1.0;
	vec4 s0 = texture( probesSH, vec3( uvw.xy, ( uvZBase                       ) / atlasDepth ) );
	vec4 s1 = texture( probesSH, vec3( uvw.xy, ( uvZBase +       paddedSlices   ) / atlasDepth ) );
	vec4 s2 = texture( probesSH, vec3( uvw.xy, ( uvZBase + 2.0 * paddedSlices   ) / atlasDepth ) );
	vec4 s3 = texture( probesSH, vec3( uvw.xy, ( uvZBase + 3.0 * paddedSlices   ) / atlasDepth ) );
	vec4 s4 = texture( probesSH, vec3( uvw.xy, ( uvZBase + 4.0 * paddedSlices   ) / atlasDepth ) );
	vec4 s5 = texture( probesSH, vec3( uvw.xy, ( uvZBase + 5.0 * paddedSlices   ) / atlasDepth ) );
	vec4 s6 = texture( probesSH, vec3( uvw.xy, ( uvZBase + 6.0 * paddedSlices   ) / atlasDepth ) );
	vec3 c0 = s0.xyz;
	vec3 c1 = vec3( s0.w, s1.xy );
	vec3 c2 = vec3( s1.zw, s2.x );
	vec3 c3 = s2.yzw;
	vec3 c4 = s3.xyz;
	vec3 c5 = vec3( s3.w, s4.xy );
	vec3 c6 = vec3( s4.zw, s5.x );
	vec3 c7 = s5.yzw;
	vec3 c8 = s6.xyz;
	float x = worldNormal.x, y = worldNormal.y, z = worldNormal.z;
	vec3 result = c0 * 0.886227;
	result += c1 * 2.0 * 0.511664 * y;
	result += c2 * 2.0 * 0.511664 * z;
	result += c3 * 2.0 * 0.511664 * x;
	result += c4 * 2.0 * 0.429043 * x * y;
	result += c5 * 2.0 * 0.429043 * y * z;
	result += c6 * ( 0.743125 * z * z - 0.247708 );
	result += c7 * 2.0 * 0.429043 * x * z;
	result += c8 * 0.429043 * ( x * x - y * y );
	return max( result, vec3( 0.0 ) );
}
#endif`,X_=`#if defined( USE_LOGARITHMIC_DEPTH_BUFFER )
	gl_FragDepth = vIsPerspective == 0.0 ? gl_FragCoord.z : log2( vFragDepth ) * logDepthBufFC * 0.5;
#endif`,q_=`#if defined( USE_LOGARITHMIC_DEPTH_BUFFER )
	uniform float logDepthBufFC;
	varying float vFragDepth;
	varying float vIsPerspective;
#endif`,$_=`#ifdef USE_LOGARITHMIC_DEPTH_BUFFER
	varying float vFragDepth;
	varying float vIsPerspective;
#endif`,Y_=`#ifdef USE_LOGARITHMIC_DEPTH_BUFFER
	vFragDepth = 1.0 + gl_Position.w;
	vIsPerspective = float( isPerspectiveMatrix( projectionMatrix ) );
#endif`,K_=`#ifdef USE_MAP
	vec4 sampledDiffuseColor = texture2D( map, vMapUv );
	#ifdef DECODE_VIDEO_TEXTURE
		sampledDiffuseColor = sRGBTransferEOTF( sampledDiffuseColor );
	#endif
	diffuseColor *= sampledDiffuseColor;
#endif`,Z_=`#ifdef USE_MAP
	uniform sampler2D map;
#endif`,j_=`#if defined( USE_MAP ) || defined( USE_ALPHAMAP )
	#if defined( USE_POINTS_UV )
		vec2 uv = vUv;
	#else
		vec2 uv = ( uvTransform * vec3( gl_PointCoord.x, 1.0 - gl_PointCoord.y, 1 ) ).xy;
	#endif
#endif
#ifdef USE_MAP
	diffuseColor *= texture2D( map, uv );
#endif
#ifdef USE_ALPHAMAP
	diffuseColor.a *= texture2D( alphaMap, uv ).g;
#endif`,Q_=`#if defined( USE_POINTS_UV )
	varying vec2 vUv;
#else
	#if defined( USE_MAP ) || defined( USE_ALPHAMAP )
		uniform mat3 uvTransform;
	#endif
#endif
#ifdef USE_MAP
	uniform sampler2D map;
#endif
#ifdef USE_ALPHAMAP
	uniform sampler2D alphaMap;
#endif`,J_=`float metalnessFactor = metalness;
#ifdef USE_METALNESSMAP
	vec4 texelMetalness = texture2D( metalnessMap, vMetalnessMapUv );
	metalnessFactor *= texelMetalness.b;
#endif`,tx=`#ifdef USE_METALNESSMAP
	uniform sampler2D metalnessMap;
#endif`,ex=`#ifdef USE_INSTANCING_MORPH
	float morphTargetInfluences[ MORPHTARGETS_COUNT ];
	float morphTargetBaseInfluence = texelFetch( morphTexture, ivec2( 0, gl_InstanceID ), 0 ).r;
	for ( int i = 0; i < MORPHTARGETS_COUNT; i ++ ) {
		morphTargetInfluences[i] =  texelFetch( morphTexture, ivec2( i + 1, gl_InstanceID ), 0 ).r;
	}
#endif`,nx=`#if defined( USE_MORPHCOLORS )
	#if defined( USE_COLOR_ALPHA )
		vColor *= morphTargetBaseInfluence;
	#elif defined( USE_COLOR )
		vColor.rgb *= morphTargetBaseInfluence;
	#endif
	for ( int i = 0; i < MORPHTARGETS_COUNT; i ++ ) {
		#if defined( USE_COLOR_ALPHA )
			if ( morphTargetInfluences[ i ] != 0.0 ) vColor += getMorph( gl_VertexID, i, 2 ) * morphTargetInfluences[ i ];
		#elif defined( USE_COLOR )
			if ( morphTargetInfluences[ i ] != 0.0 ) vColor.rgb += getMorph( gl_VertexID, i, 2 ).rgb * morphTargetInfluences[ i ];
		#endif
	}
#endif`,ix=`#ifdef USE_MORPHNORMALS
	objectNormal *= morphTargetBaseInfluence;
	for ( int i = 0; i < MORPHTARGETS_COUNT; i ++ ) {
		if ( morphTargetInfluences[ i ] != 0.0 ) objectNormal += getMorph( gl_VertexID, i, 1 ).xyz * morphTargetInfluences[ i ];
	}
#endif`,sx=`#ifdef USE_MORPHTARGETS
	#ifndef USE_INSTANCING_MORPH
		uniform float morphTargetBaseInfluence;
		uniform float morphTargetInfluences[ MORPHTARGETS_COUNT ];
	#endif
	uniform sampler2DArray morphTargetsTexture;
	uniform ivec2 morphTargetsTextureSize;
	vec4 getMorph( const in int vertexIndex, const in int morphTargetIndex, const in int offset ) {
		int texelIndex = vertexIndex * MORPHTARGETS_TEXTURE_STRIDE + offset;
		int y = texelIndex / morphTargetsTextureSize.x;
		int x = texelIndex - y * morphTargetsTextureSize.x;
		ivec3 morphUV = ivec3( x, y, morphTargetIndex );
		return texelFetch( morphTargetsTexture, morphUV, 0 );
	}
#endif`,rx=`#ifdef USE_MORPHTARGETS
	transformed *= morphTargetBaseInfluence;
	for ( int i = 0; i < MORPHTARGETS_COUNT; i ++ ) {
		if ( morphTargetInfluences[ i ] != 0.0 ) transformed += getMorph( gl_VertexID, i, 0 ).xyz * morphTargetInfluences[ i ];
	}
#endif`,ox=`float faceDirection = gl_FrontFacing ? 1.0 : - 1.0;
#ifdef FLAT_SHADED
	vec3 fdx = dFdx( vViewPosition );
	vec3 fdy = dFdy( vViewPosition );
	vec3 normal = normalize( cross( fdx, fdy ) );
#else
	vec3 normal = normalize( vNormal );
	#ifdef DOUBLE_SIDED
		normal *= faceDirection;
	#endif
#endif
#if defined( USE_NORMALMAP_TANGENTSPACE ) || defined( USE_CLEARCOAT_NORMALMAP ) || defined( USE_ANISOTROPY )
	#ifdef USE_TANGENT
		mat3 tbn = mat3( normalize( vTangent ), normalize( vBitangent ), normal );
	#else
		mat3 tbn = getTangentFrame( - vViewPosition, normal,
		#if defined( USE_NORMALMAP )
			vNormalMapUv
		#elif defined( USE_CLEARCOAT_NORMALMAP )
			vClearcoatNormalMapUv
		#else
			vUv
		#endif
		);
	#endif
	#ifdef DOUBLE_SIDED
		tbn[0] *= faceDirection;
		tbn[1] *= faceDirection;
	#endif
#endif
#ifdef USE_CLEARCOAT_NORMALMAP
	#ifdef USE_TANGENT
		mat3 tbn2 = mat3( normalize( vTangent ), normalize( vBitangent ), normal );
	#else
		mat3 tbn2 = getTangentFrame( - vViewPosition, normal, vClearcoatNormalMapUv );
	#endif
	#ifdef DOUBLE_SIDED
		tbn2[0] *= faceDirection;
		tbn2[1] *= faceDirection;
	#endif
#endif
vec3 nonPerturbedNormal = normal;`,ax=`#ifdef USE_NORMALMAP_OBJECTSPACE
	normal = texture2D( normalMap, vNormalMapUv ).xyz * 2.0 - 1.0;
	#ifdef FLIP_SIDED
		normal = - normal;
	#endif
	#ifdef DOUBLE_SIDED
		normal = normal * faceDirection;
	#endif
	normal = normalize( normalMatrix * normal );
#elif defined( USE_NORMALMAP_TANGENTSPACE )
	vec3 mapN = texture2D( normalMap, vNormalMapUv ).xyz * 2.0 - 1.0;
	#if defined( USE_PACKED_NORMALMAP )
		mapN = vec3( mapN.xy, sqrt( saturate( 1.0 - dot( mapN.xy, mapN.xy ) ) ) );
	#endif
	mapN.xy *= normalScale;
	normal = normalize( tbn * mapN );
#elif defined( USE_BUMPMAP )
	normal = perturbNormalArb( - vViewPosition, normal, dHdxy_fwd(), faceDirection );
#endif`,lx=`#ifndef FLAT_SHADED
	varying vec3 vNormal;
	#ifdef USE_TANGENT
		varying vec3 vTangent;
		varying vec3 vBitangent;
	#endif
#endif`,cx=`#ifndef FLAT_SHADED
	varying vec3 vNormal;
	#ifdef USE_TANGENT
		varying vec3 vTangent;
		varying vec3 vBitangent;
	#endif
#endif`,hx=`#ifndef FLAT_SHADED
	vNormal = normalize( transformedNormal );
	#ifdef USE_TANGENT
		vTangent = normalize( transformedTangent );
		vBitangent = normalize( cross( vNormal, vTangent ) * tangent.w );
		#ifdef FLIP_SIDED
			vBitangent = - vBitangent;
		#endif
	#endif
#endif`,ux=`#ifdef USE_NORMALMAP
	uniform sampler2D normalMap;
	uniform vec2 normalScale;
#endif
#ifdef USE_NORMALMAP_OBJECTSPACE
	uniform mat3 normalMatrix;
#endif
#if ! defined ( USE_TANGENT ) && ( defined ( USE_NORMALMAP_TANGENTSPACE ) || defined ( USE_CLEARCOAT_NORMALMAP ) || defined( USE_ANISOTROPY ) )
	mat3 getTangentFrame( vec3 eye_pos, vec3 surf_norm, vec2 uv ) {
		vec3 q0 = dFdx( eye_pos.xyz );
		vec3 q1 = dFdy( eye_pos.xyz );
		vec2 st0 = dFdx( uv.st );
		vec2 st1 = dFdy( uv.st );
		vec3 N = surf_norm;
		vec3 q1perp = cross( q1, N );
		vec3 q0perp = cross( N, q0 );
		vec3 T = q1perp * st0.x + q0perp * st1.x;
		vec3 B = q1perp * st0.y + q0perp * st1.y;
		float det = max( dot( T, T ), dot( B, B ) );
		float scale = ( det == 0.0 ) ? 0.0 : inversesqrt( det );
		return mat3( T * scale, B * scale, N );
	}
#endif`,dx=`#ifdef USE_CLEARCOAT
	vec3 clearcoatNormal = nonPerturbedNormal;
#endif`,px=`#ifdef USE_CLEARCOAT_NORMALMAP
	vec3 clearcoatMapN = texture2D( clearcoatNormalMap, vClearcoatNormalMapUv ).xyz * 2.0 - 1.0;
	clearcoatMapN.xy *= clearcoatNormalScale;
	clearcoatNormal = normalize( tbn2 * clearcoatMapN );
#endif`,fx=`#ifdef USE_CLEARCOATMAP
	uniform sampler2D clearcoatMap;
#endif
#ifdef USE_CLEARCOAT_NORMALMAP
	uniform sampler2D clearcoatNormalMap;
	uniform vec2 clearcoatNormalScale;
#endif
#ifdef USE_CLEARCOAT_ROUGHNESSMAP
	uniform sampler2D clearcoatRoughnessMap;
#endif`,mx=`#ifdef USE_IRIDESCENCEMAP
	uniform sampler2D iridescenceMap;
#endif
#ifdef USE_IRIDESCENCE_THICKNESSMAP
	uniform sampler2D iridescenceThicknessMap;
#endif`,gx=`#ifdef OPAQUE
diffuseColor.a = 1.0;
#endif
#ifdef USE_TRANSMISSION
diffuseColor.a *= material.transmissionAlpha;
#endif
gl_FragColor = vec4( outgoingLight, diffuseColor.a );`,vx=`vec3 packNormalToRGB( const in vec3 normal ) {
	return normalize( normal ) * 0.5 + 0.5;
}
vec3 unpackRGBToNormal( const in vec3 rgb ) {
	return 2.0 * rgb.xyz - 1.0;
}
const float PackUpscale = 256. / 255.;const float UnpackDownscale = 255. / 256.;const float ShiftRight8 = 1. / 256.;
const float Inv255 = 1. / 255.;
const vec4 PackFactors = vec4( 1.0, 256.0, 256.0 * 256.0, 256.0 * 256.0 * 256.0 );
const vec2 UnpackFactors2 = vec2( UnpackDownscale, 1.0 / PackFactors.g );
const vec3 UnpackFactors3 = vec3( UnpackDownscale / PackFactors.rg, 1.0 / PackFactors.b );
const vec4 UnpackFactors4 = vec4( UnpackDownscale / PackFactors.rgb, 1.0 / PackFactors.a );
vec4 packDepthToRGBA( const in float v ) {
	if( v <= 0.0 )
		return vec4( 0., 0., 0., 0. );
	if( v >= 1.0 )
		return vec4( 1., 1., 1., 1. );
	float vuf;
	float af = modf( v * PackFactors.a, vuf );
	float bf = modf( vuf * ShiftRight8, vuf );
	float gf = modf( vuf * ShiftRight8, vuf );
	return vec4( vuf * Inv255, gf * PackUpscale, bf * PackUpscale, af );
}
vec3 packDepthToRGB( const in float v ) {
	if( v <= 0.0 )
		return vec3( 0., 0., 0. );
	if( v >= 1.0 )
		return vec3( 1., 1., 1. );
	float vuf;
	float bf = modf( v * PackFactors.b, vuf );
	float gf = modf( vuf * ShiftRight8, vuf );
	return vec3( vuf * Inv255, gf * PackUpscale, bf );
}
vec2 packDepthToRG( const in float v ) {
	if( v <= 0.0 )
		return vec2( 0., 0. );
	if( v >= 1.0 )
		return vec2( 1., 1. );
	float vuf;
	float gf = modf( v * 256., vuf );
	return vec2( vuf * Inv255, gf );
}
float unpackRGBAToDepth( const in vec4 v ) {
	return dot( v, UnpackFactors4 );
}
float unpackRGBToDepth( const in vec3 v ) {
	return dot( v, UnpackFactors3 );
}
float unpackRGToDepth( const in vec2 v ) {
	return v.r * UnpackFactors2.r + v.g * UnpackFactors2.g;
}
vec4 pack2HalfToRGBA( const in vec2 v ) {
	vec4 r = vec4( v.x, fract( v.x * 255.0 ), v.y, fract( v.y * 255.0 ) );
	return vec4( r.x - r.y / 255.0, r.y, r.z - r.w / 255.0, r.w );
}
vec2 unpackRGBATo2Half( const in vec4 v ) {
	return vec2( v.x + ( v.y / 255.0 ), v.z + ( v.w / 255.0 ) );
}
float viewZToOrthographicDepth( const in float viewZ, const in float near, const in float far ) {
	return ( viewZ + near ) / ( near - far );
}
float orthographicDepthToViewZ( const in float depth, const in float near, const in float far ) {
	#ifdef USE_REVERSED_DEPTH_BUFFER
	
		return depth * ( far - near ) - far;
	#else
		return depth * ( near - far ) - near;
	#endif
}
float viewZToPerspectiveDepth( const in float viewZ, const in float near, const in float far ) {
	return ( ( near + viewZ ) * far ) / ( ( far - near ) * viewZ );
}
float perspectiveDepthToViewZ( const in float depth, const in float near, const in float far ) {
	
	#ifdef USE_REVERSED_DEPTH_BUFFER
		return ( near * far ) / ( ( near - far ) * depth - near );
	#else
		return ( near * far ) / ( ( far - near ) * depth - far );
	#endif
}`,_x=`#ifdef PREMULTIPLIED_ALPHA
	gl_FragColor.rgb *= gl_FragColor.a;
#endif`,xx=`vec4 mvPosition = vec4( transformed, 1.0 );
#ifdef USE_BATCHING
	mvPosition = batchingMatrix * mvPosition;
#endif
#ifdef USE_INSTANCING
	mvPosition = instanceMatrix * mvPosition;
#endif
mvPosition = modelViewMatrix * mvPosition;
gl_Position = projectionMatrix * mvPosition;`,bx=`#ifdef DITHERING
	gl_FragColor.rgb = dithering( gl_FragColor.rgb );
#endif`,wx=`#ifdef DITHERING
	vec3 dithering( vec3 color ) {
		float grid_position = rand( gl_FragCoord.xy );
		vec3 dither_shift_RGB = vec3( 0.25 / 255.0, -0.25 / 255.0, 0.25 / 255.0 );
		dither_shift_RGB = mix( 2.0 * dither_shift_RGB, -2.0 * dither_shift_RGB, grid_position );
		return color + dither_shift_RGB;
	}
#endif`,yx=`float roughnessFactor = roughness;
#ifdef USE_ROUGHNESSMAP
	vec4 texelRoughness = texture2D( roughnessMap, vRoughnessMapUv );
	roughnessFactor *= texelRoughness.g;
#endif`,Sx=`#ifdef USE_ROUGHNESSMAP
	uniform sampler2D roughnessMap;
#endif`,Ex=`#if NUM_SPOT_LIGHT_COORDS > 0
	varying vec4 vSpotLightCoord[ NUM_SPOT_LIGHT_COORDS ];
#endif
#if NUM_SPOT_LIGHT_MAPS > 0
	uniform sampler2D spotLightMap[ NUM_SPOT_LIGHT_MAPS ];
#endif
#ifdef USE_SHADOWMAP
	#if NUM_SUN_LIGHT_SHADOWS > 0
		#define SUN_LIGHT_CASCADES 2
		#if defined( SHADOWMAP_TYPE_PCF )
			uniform sampler2DShadow sunShadowMap[ NUM_SUN_LIGHT_SHADOWS ];
		#else
			uniform sampler2D sunShadowMap[ NUM_SUN_LIGHT_SHADOWS ];
		#endif
		uniform mat4 sunShadowMatrix[ NUM_SUN_LIGHT_SHADOWS * SUN_LIGHT_CASCADES ];
		uniform vec4 sunShadowCascade[ NUM_SUN_LIGHT_SHADOWS * SUN_LIGHT_CASCADES ];
		varying vec4 vSunShadowWorldPosition;
		varying vec3 vSunShadowWorldNormal;
		struct SunLightShadow {
			float shadowIntensity;
			float shadowBias;
			float shadowNormalBias;
			float shadowRadius;
			vec2 shadowMapSize;
		};
		uniform SunLightShadow sunLightShadows[ NUM_SUN_LIGHT_SHADOWS ];
	#endif
	#if NUM_DIR_LIGHT_SHADOWS > 0
		#if defined( SHADOWMAP_TYPE_PCF )
			uniform sampler2DShadow directionalShadowMap[ NUM_DIR_LIGHT_SHADOWS ];
		#else
			uniform sampler2D directionalShadowMap[ NUM_DIR_LIGHT_SHADOWS ];
		#endif
		varying vec4 vDirectionalShadowCoord[ NUM_DIR_LIGHT_SHADOWS ];
		struct DirectionalLightShadow {
			float shadowIntensity;
			float shadowBias;
			float shadowNormalBias;
			float shadowRadius;
			vec2 shadowMapSize;
		};
		uniform DirectionalLightShadow directionalLightShadows[ NUM_DIR_LIGHT_SHADOWS ];
	#endif
	#if NUM_SPOT_LIGHT_SHADOWS > 0
		#if defined( SHADOWMAP_TYPE_PCF )
			uniform sampler2DShadow spotShadowMap[ NUM_SPOT_LIGHT_SHADOWS ];
		#else
			uniform sampler2D spotShadowMap[ NUM_SPOT_LIGHT_SHADOWS ];
		#endif
		struct SpotLightShadow {
			float shadowIntensity;
			float shadowBias;
			float shadowNormalBias;
			float shadowRadius;
			vec2 shadowMapSize;
		};
		uniform SpotLightShadow spotLightShadows[ NUM_SPOT_LIGHT_SHADOWS ];
	#endif
	#if NUM_POINT_LIGHT_SHADOWS > 0
		#if defined( SHADOWMAP_TYPE_PCF )
			uniform samplerCubeShadow pointShadowMap[ NUM_POINT_LIGHT_SHADOWS ];
		#elif defined( SHADOWMAP_TYPE_BASIC )
			uniform samplerCube pointShadowMap[ NUM_POINT_LIGHT_SHADOWS ];
		#endif
		varying vec4 vPointShadowCoord[ NUM_POINT_LIGHT_SHADOWS ];
		struct PointLightShadow {
			float shadowIntensity;
			float shadowBias;
			float shadowNormalBias;
			float shadowRadius;
			vec2 shadowMapSize;
			float shadowCameraNear;
			float shadowCameraFar;
		};
		uniform PointLightShadow pointLightShadows[ NUM_POINT_LIGHT_SHADOWS ];
	#endif
	#if defined( SHADOWMAP_TYPE_PCF )
		float interleavedGradientNoise( vec2 position ) {
			return fract( 52.9829189 * fract( dot( position, vec2( 0.06711056, 0.00583715 ) ) ) );
		}
		vec2 vogelDiskSample( int sampleIndex, int samplesCount, float phi ) {
			const float goldenAngle = 2.399963229728653;
			float r = sqrt( ( float( sampleIndex ) + 0.5 ) / float( samplesCount ) );
			float theta = float( sampleIndex ) * goldenAngle + phi;
			return vec2( cos( theta ), sin( theta ) ) * r;
		}
	#endif
	#if defined( SHADOWMAP_TYPE_PCF )
		float getShadow( sampler2DShadow shadowMap, vec2 shadowMapSize, float shadowIntensity, float shadowBias, float shadowRadius, vec4 shadowCoord ) {
			float shadow = 1.0;
			shadowCoord.xyz /= shadowCoord.w;
			#ifdef USE_REVERSED_DEPTH_BUFFER
				shadowCoord.z -= shadowBias;
			#else
				shadowCoord.z += shadowBias;
			#endif
			bool inFrustum = shadowCoord.x >= 0.0 && shadowCoord.x <= 1.0 && shadowCoord.y >= 0.0 && shadowCoord.y <= 1.0;
			bool frustumTest = inFrustum && shadowCoord.z <= 1.0;
			if ( frustumTest ) {
				vec2 texelSize = vec2( 1.0 ) / shadowMapSize;
				vec2 radius = shadowRadius * texelSize;
				float phi = interleavedGradientNoise( gl_FragCoord.xy ) * PI2;
				shadow = (
					texture( shadowMap, vec3( shadowCoord.xy + vogelDiskSample( 0, 5, phi ) * radius, shadowCoord.z ) ) +
					texture( shadowMap, vec3( shadowCoord.xy + vogelDiskSample( 1, 5, phi ) * radius, shadowCoord.z ) ) +
					texture( shadowMap, vec3( shadowCoord.xy + vogelDiskSample( 2, 5, phi ) * radius, shadowCoord.z ) ) +
					texture( shadowMap, vec3( shadowCoord.xy + vogelDiskSample( 3, 5, phi ) * radius, shadowCoord.z ) ) +
					texture( shadowMap, vec3( shadowCoord.xy + vogelDiskSample( 4, 5, phi ) * radius, shadowCoord.z ) )
				) * 0.2;
			}
			return mix( 1.0, shadow, shadowIntensity );
		}
	#elif defined( SHADOWMAP_TYPE_VSM )
		float getShadow( sampler2D shadowMap, vec2 shadowMapSize, float shadowIntensity, float shadowBias, float shadowRadius, vec4 shadowCoord ) {
			float shadow = 1.0;
			shadowCoord.xyz /= shadowCoord.w;
			#ifdef USE_REVERSED_DEPTH_BUFFER
				shadowCoord.z -= shadowBias;
			#else
				shadowCoord.z += shadowBias;
			#endif
			bool inFrustum = shadowCoord.x >= 0.0 && shadowCoord.x <= 1.0 && shadowCoord.y >= 0.0 && shadowCoord.y <= 1.0;
			bool frustumTest = inFrustum && shadowCoord.z <= 1.0;
			if ( frustumTest ) {
				vec2 distribution = texture2D( shadowMap, shadowCoord.xy ).rg;
				float mean = distribution.x;
				float variance = distribution.y * distribution.y;
				#ifdef USE_REVERSED_DEPTH_BUFFER
					float hard_shadow = step( mean, shadowCoord.z );
				#else
					float hard_shadow = step( shadowCoord.z, mean );
				#endif
				
				if ( hard_shadow == 1.0 ) {
					shadow = 1.0;
				} else {
					variance = max( variance, 0.0000001 );
					float d = shadowCoord.z - mean;
					float p_max = variance / ( variance + d * d );
					p_max = clamp( ( p_max - 0.3 ) / 0.65, 0.0, 1.0 );
					shadow = max( hard_shadow, p_max );
				}
			}
			return mix( 1.0, shadow, shadowIntensity );
		}
	#else
		float getShadow( sampler2D shadowMap, vec2 shadowMapSize, float shadowIntensity, float shadowBias, float shadowRadius, vec4 shadowCoord ) {
			float shadow = 1.0;
			shadowCoord.xyz /= shadowCoord.w;
			#ifdef USE_REVERSED_DEPTH_BUFFER
				shadowCoord.z -= shadowBias;
			#else
				shadowCoord.z += shadowBias;
			#endif
			bool inFrustum = shadowCoord.x >= 0.0 && shadowCoord.x <= 1.0 && shadowCoord.y >= 0.0 && shadowCoord.y <= 1.0;
			bool frustumTest = inFrustum && shadowCoord.z <= 1.0;
			if ( frustumTest ) {
				float depth = texture2D( shadowMap, shadowCoord.xy ).r;
				#ifdef USE_REVERSED_DEPTH_BUFFER
					shadow = step( depth, shadowCoord.z );
				#else
					shadow = step( shadowCoord.z, depth );
				#endif
			}
			return mix( 1.0, shadow, shadowIntensity );
		}
	#endif
	#if NUM_SUN_LIGHT_SHADOWS > 0
		float getSunShadow(
			#if defined( SHADOWMAP_TYPE_PCF )
				sampler2DShadow shadowMap,
			#else
				sampler2D shadowMap,
			#endif
			SunLightShadow sunLightShadow,
			int shadowIndex
		) {
			vec4 shadowWorldPosition = vec4( vSunShadowWorldPosition.xyz + vSunShadowWorldNormal * sunLightShadow.shadowNormalBias, 1.0 );
			float viewDepth = vSunShadowWorldPosition.w;
			int cascadeOffset = shadowIndex * SUN_LIGHT_CASCADES;
			float shadow = 1.0;
			for ( int i = SUN_LIGHT_CASCADES - 1; i >= 0; i -- ) {
				vec4 cascade = sunShadowCascade[ cascadeOffset + i ];
				if ( viewDepth >= cascade.x && viewDepth < cascade.y ) {
					float cascadeShadow = getShadow(
						shadowMap,
						sunLightShadow.shadowMapSize,
						sunLightShadow.shadowIntensity,
						sunLightShadow.shadowBias,
						sunLightShadow.shadowRadius,
						sunShadowMatrix[ cascadeOffset + i ] * shadowWorldPosition
					);
					shadow = mix( cascadeShadow, shadow, smoothstep( cascade.z, cascade.y, viewDepth ) );
				}
			}
			return shadow;
		}
	#endif
	#if NUM_POINT_LIGHT_SHADOWS > 0
	#if defined( SHADOWMAP_TYPE_PCF )
	float getPointShadow( samplerCubeShadow shadowMap, vec2 shadowMapSize, float shadowIntensity, float shadowBias, float shadowRadius, vec4 shadowCoord, float shadowCameraNear, float shadowCameraFar ) {
		float shadow = 1.0;
		vec3 lightToPosition = shadowCoord.xyz;
		vec3 bd3D = normalize( lightToPosition );
		vec3 absVec = abs( lightToPosition );
		float viewSpaceZ = max( max( absVec.x, absVec.y ), absVec.z );
		if ( viewSpaceZ - shadowCameraFar <= 0.0 && viewSpaceZ - shadowCameraNear >= 0.0 ) {
			float lightDistance = length( lightToPosition );
			float depthRange = shadowCameraFar - shadowCameraNear;
			#ifdef USE_REVERSED_DEPTH_BUFFER
				float depthA = - shadowCameraNear / depthRange - shadowBias;
				float depthB = shadowCameraNear * shadowCameraFar / ( depthRange * lightDistance );
			#else
				float depthA = shadowCameraFar / depthRange + shadowBias;
				float depthB = - shadowCameraNear * shadowCameraFar / ( depthRange * lightDistance );
			#endif
			float texelSize = shadowRadius / shadowMapSize.x;
			vec3 absDir = abs( bd3D );
			vec3 tangent = absDir.x > absDir.z ? vec3( 0.0, 1.0, 0.0 ) : vec3( 1.0, 0.0, 0.0 );
			tangent = normalize( cross( bd3D, tangent ) );
			vec3 bitangent = cross( bd3D, tangent );
			float phi = interleavedGradientNoise( gl_FragCoord.xy ) * PI2;
			shadow = 0.0;
			for ( int i = 0; i < 5; i ++ ) {
				vec2 offset = vogelDiskSample( i, 5, phi );
				vec3 direction = bd3D + ( tangent * offset.x + bitangent * offset.y ) * texelSize;
				vec3 absDirection = abs( direction );
				float dp = depthA + depthB / max( max( absDirection.x, absDirection.y ), absDirection.z );
				shadow += texture( shadowMap, vec4( direction, dp ) );
			}
			shadow *= 0.2;
		}
		return mix( 1.0, shadow, shadowIntensity );
	}
	#elif defined( SHADOWMAP_TYPE_BASIC )
	float getPointShadow( samplerCube shadowMap, vec2 shadowMapSize, float shadowIntensity, float shadowBias, float shadowRadius, vec4 shadowCoord, float shadowCameraNear, float shadowCameraFar ) {
		float shadow = 1.0;
		vec3 lightToPosition = shadowCoord.xyz;
		vec3 absVec = abs( lightToPosition );
		float viewSpaceZ = max( max( absVec.x, absVec.y ), absVec.z );
		if ( viewSpaceZ - shadowCameraFar <= 0.0 && viewSpaceZ - shadowCameraNear >= 0.0 ) {
			float dp = ( shadowCameraFar * ( viewSpaceZ - shadowCameraNear ) ) / ( viewSpaceZ * ( shadowCameraFar - shadowCameraNear ) );
			dp += shadowBias;
			vec3 bd3D = normalize( lightToPosition );
			float depth = textureCube( shadowMap, bd3D ).r;
			#ifdef USE_REVERSED_DEPTH_BUFFER
				depth = 1.0 - depth;
			#endif
			shadow = step( dp, depth );
		}
		return mix( 1.0, shadow, shadowIntensity );
	}
	#endif
	#endif
#endif`,Mx=`#if NUM_SPOT_LIGHT_COORDS > 0
	uniform mat4 spotLightMatrix[ NUM_SPOT_LIGHT_COORDS ];
	varying vec4 vSpotLightCoord[ NUM_SPOT_LIGHT_COORDS ];
#endif
#ifdef USE_SHADOWMAP
	#if NUM_SUN_LIGHT_SHADOWS > 0
		varying vec4 vSunShadowWorldPosition;
		varying vec3 vSunShadowWorldNormal;
	#endif
	#if NUM_DIR_LIGHT_SHADOWS > 0
		uniform mat4 directionalShadowMatrix[ NUM_DIR_LIGHT_SHADOWS ];
		varying vec4 vDirectionalShadowCoord[ NUM_DIR_LIGHT_SHADOWS ];
		struct DirectionalLightShadow {
			float shadowIntensity;
			float shadowBias;
			float shadowNormalBias;
			float shadowRadius;
			vec2 shadowMapSize;
		};
		uniform DirectionalLightShadow directionalLightShadows[ NUM_DIR_LIGHT_SHADOWS ];
	#endif
	#if NUM_SPOT_LIGHT_SHADOWS > 0
		struct SpotLightShadow {
			float shadowIntensity;
			float shadowBias;
			float shadowNormalBias;
			float shadowRadius;
			vec2 shadowMapSize;
		};
		uniform SpotLightShadow spotLightShadows[ NUM_SPOT_LIGHT_SHADOWS ];
	#endif
	#if NUM_POINT_LIGHT_SHADOWS > 0
		uniform mat4 pointShadowMatrix[ NUM_POINT_LIGHT_SHADOWS ];
		varying vec4 vPointShadowCoord[ NUM_POINT_LIGHT_SHADOWS ];
		struct PointLightShadow {
			float shadowIntensity;
			float shadowBias;
			float shadowNormalBias;
			float shadowRadius;
			vec2 shadowMapSize;
			float shadowCameraNear;
			float shadowCameraFar;
		};
		uniform PointLightShadow pointLightShadows[ NUM_POINT_LIGHT_SHADOWS ];
	#endif
#endif`,Tx=`#if ( defined( USE_SHADOWMAP ) && ( NUM_DIR_LIGHT_SHADOWS > 0 || NUM_SUN_LIGHT_SHADOWS > 0 || NUM_POINT_LIGHT_SHADOWS > 0 ) ) || ( NUM_SPOT_LIGHT_COORDS > 0 )
	#ifdef HAS_NORMAL
		vec3 shadowWorldNormal = transformNormalByInverseViewMatrix( transformedNormal, viewMatrix );
	#else
		vec3 shadowWorldNormal = vec3( 0.0 );
	#endif
	vec4 shadowWorldPosition;
#endif
#if defined( USE_SHADOWMAP )
	#if NUM_SUN_LIGHT_SHADOWS > 0
		vSunShadowWorldPosition = vec4( worldPosition.xyz, - mvPosition.z );
		vSunShadowWorldNormal = shadowWorldNormal;
	#endif
	#if NUM_DIR_LIGHT_SHADOWS > 0
		#pragma unroll_loop_start
		for ( int i = 0; i < NUM_DIR_LIGHT_SHADOWS; i ++ ) {
			shadowWorldPosition = worldPosition + vec4( shadowWorldNormal * directionalLightShadows[ i ].shadowNormalBias, 0 );
			vDirectionalShadowCoord[ i ] = directionalShadowMatrix[ i ] * shadowWorldPosition;
		}
		#pragma unroll_loop_end
	#endif
	#if NUM_POINT_LIGHT_SHADOWS > 0
		#pragma unroll_loop_start
		for ( int i = 0; i < NUM_POINT_LIGHT_SHADOWS; i ++ ) {
			shadowWorldPosition = worldPosition + vec4( shadowWorldNormal * pointLightShadows[ i ].shadowNormalBias, 0 );
			vPointShadowCoord[ i ] = pointShadowMatrix[ i ] * shadowWorldPosition;
		}
		#pragma unroll_loop_end
	#endif
#endif
#if NUM_SPOT_LIGHT_COORDS > 0
	#pragma unroll_loop_start
	for ( int i = 0; i < NUM_SPOT_LIGHT_COORDS; i ++ ) {
		shadowWorldPosition = worldPosition;
		#if ( defined( USE_SHADOWMAP ) && UNROLLED_LOOP_INDEX < NUM_SPOT_LIGHT_SHADOWS )
			shadowWorldPosition.xyz += shadowWorldNormal * spotLightShadows[ i ].shadowNormalBias;
		#endif
		vSpotLightCoord[ i ] = spotLightMatrix[ i ] * shadowWorldPosition;
	}
	#pragma unroll_loop_end
#endif`,Ax=`float getShadowMask() {
	float shadow = 1.0;
	#ifdef USE_SHADOWMAP
	#if NUM_SUN_LIGHT_SHADOWS > 0
	SunLightShadow sunLight;
	#pragma unroll_loop_start
	for ( int i = 0; i < NUM_SUN_LIGHT_SHADOWS; i ++ ) {
		sunLight = sunLightShadows[ i ];
		shadow *= receiveShadow ? getSunShadow( sunShadowMap[ i ], sunLight, UNROLLED_LOOP_INDEX ) : 1.0;
	}
	#pragma unroll_loop_end
	#endif
	#if NUM_DIR_LIGHT_SHADOWS > 0
	DirectionalLightShadow directionalLight;
	#pragma unroll_loop_start
	for ( int i = 0; i < NUM_DIR_LIGHT_SHADOWS; i ++ ) {
		directionalLight = directionalLightShadows[ i ];
		shadow *= receiveShadow ? getShadow( directionalShadowMap[ i ], directionalLight.shadowMapSize, directionalLight.shadowIntensity, directionalLight.shadowBias, directionalLight.shadowRadius, vDirectionalShadowCoord[ i ] ) : 1.0;
	}
	#pragma unroll_loop_end
	#endif
	#if NUM_SPOT_LIGHT_SHADOWS > 0
	SpotLightShadow spotLight;
	#pragma unroll_loop_start
	for ( int i = 0; i < NUM_SPOT_LIGHT_SHADOWS; i ++ ) {
		spotLight = spotLightShadows[ i ];
		shadow *= receiveShadow ? getShadow( spotShadowMap[ i ], spotLight.shadowMapSize, spotLight.shadowIntensity, spotLight.shadowBias, spotLight.shadowRadius, vSpotLightCoord[ i ] ) : 1.0;
	}
	#pragma unroll_loop_end
	#endif
	#if NUM_POINT_LIGHT_SHADOWS > 0 && ( defined( SHADOWMAP_TYPE_PCF ) || defined( SHADOWMAP_TYPE_BASIC ) )
	PointLightShadow pointLight;
	#pragma unroll_loop_start
	for ( int i = 0; i < NUM_POINT_LIGHT_SHADOWS; i ++ ) {
		pointLight = pointLightShadows[ i ];
		shadow *= receiveShadow ? getPointShadow( pointShadowMap[ i ], pointLight.shadowMapSize, pointLight.shadowIntensity, pointLight.shadowBias, pointLight.shadowRadius, vPointShadowCoord[ i ], pointLight.shadowCameraNear, pointLight.shadowCameraFar ) : 1.0;
	}
	#pragma unroll_loop_end
	#endif
	#endif
	return shadow;
}`,Cx=`#ifdef USE_SKINNING
	mat4 boneMatX = getBoneMatrix( skinIndex.x );
	mat4 boneMatY = getBoneMatrix( skinIndex.y );
	mat4 boneMatZ = getBoneMatrix( skinIndex.z );
	mat4 boneMatW = getBoneMatrix( skinIndex.w );
#endif`,Rx=`#ifdef USE_SKINNING
	uniform mat4 bindMatrix;
	uniform mat4 bindMatrixInverse;
	uniform highp sampler2D boneTexture;
	mat4 getBoneMatrix( const in float i ) {
		int size = textureSize( boneTexture, 0 ).x;
		int j = int( i ) * 4;
		int x = j % size;
		int y = j / size;
		vec4 v1 = texelFetch( boneTexture, ivec2( x, y ), 0 );
		vec4 v2 = texelFetch( boneTexture, ivec2( x + 1, y ), 0 );
		vec4 v3 = texelFetch( boneTexture, ivec2( x + 2, y ), 0 );
		vec4 v4 = texelFetch( boneTexture, ivec2( x + 3, y ), 0 );
		return mat4( v1, v2, v3, v4 );
	}
#endif`,Px=`#ifdef USE_SKINNING
	vec4 skinVertex = bindMatrix * vec4( transformed, 1.0 );
	vec4 skinned = vec4( 0.0 );
	skinned += boneMatX * skinVertex * skinWeight.x;
	skinned += boneMatY * skinVertex * skinWeight.y;
	skinned += boneMatZ * skinVertex * skinWeight.z;
	skinned += boneMatW * skinVertex * skinWeight.w;
	transformed = ( bindMatrixInverse * skinned ).xyz;
#endif`,Lx=`#ifdef USE_SKINNING
	mat4 skinMatrix = mat4( 0.0 );
	skinMatrix += skinWeight.x * boneMatX;
	skinMatrix += skinWeight.y * boneMatY;
	skinMatrix += skinWeight.z * boneMatZ;
	skinMatrix += skinWeight.w * boneMatW;
	skinMatrix = bindMatrixInverse * skinMatrix * bindMatrix;
	objectNormal = vec4( skinMatrix * vec4( objectNormal, 0.0 ) ).xyz;
	#ifdef USE_TANGENT
		objectTangent = vec4( skinMatrix * vec4( objectTangent, 0.0 ) ).xyz;
	#endif
#endif`,Dx=`float specularStrength;
#ifdef USE_SPECULARMAP
	vec4 texelSpecular = texture2D( specularMap, vSpecularMapUv );
	specularStrength = texelSpecular.r;
#else
	specularStrength = 1.0;
#endif`,Ix=`#ifdef USE_SPECULARMAP
	uniform sampler2D specularMap;
#endif`,Nx=`#if defined( TONE_MAPPING )
	gl_FragColor.rgb = toneMapping( gl_FragColor.rgb );
#endif`,Ux=`#ifndef saturate
#define saturate( a ) clamp( a, 0.0, 1.0 )
#endif
uniform float toneMappingExposure;
vec3 LinearToneMapping( vec3 color ) {
	return saturate( toneMappingExposure * color );
}
vec3 ReinhardToneMapping( vec3 color ) {
	color *= toneMappingExposure;
	return saturate( color / ( vec3( 1.0 ) + color ) );
}
vec3 CineonToneMapping( vec3 color ) {
	color *= toneMappingExposure;
	color = max( vec3( 0.0 ), color - 0.004 );
	return pow( ( color * ( 6.2 * color + 0.5 ) ) / ( color * ( 6.2 * color + 1.7 ) + 0.06 ), vec3( 2.2 ) );
}
vec3 RRTAndODTFit( vec3 v ) {
	vec3 a = v * ( v + 0.0245786 ) - 0.000090537;
	vec3 b = v * ( 0.983729 * v + 0.4329510 ) + 0.238081;
	return a / b;
}
vec3 ACESFilmicToneMapping( vec3 color ) {
	const mat3 ACESInputMat = mat3(
		vec3( 0.59719, 0.07600, 0.02840 ),		vec3( 0.35458, 0.90834, 0.13383 ),
		vec3( 0.04823, 0.01566, 0.83777 )
	);
	const mat3 ACESOutputMat = mat3(
		vec3(  1.60475, -0.10208, -0.00327 ),		vec3( -0.53108,  1.10813, -0.07276 ),
		vec3( -0.07367, -0.00605,  1.07602 )
	);
	color *= toneMappingExposure / 0.6;
	color = ACESInputMat * color;
	color = RRTAndODTFit( color );
	color = ACESOutputMat * color;
	return saturate( color );
}
const mat3 LINEAR_REC2020_TO_LINEAR_SRGB = mat3(
	vec3( 1.6605, - 0.1246, - 0.0182 ),
	vec3( - 0.5876, 1.1329, - 0.1006 ),
	vec3( - 0.0728, - 0.0083, 1.1187 )
);
const mat3 LINEAR_SRGB_TO_LINEAR_REC2020 = mat3(
	vec3( 0.6274, 0.0691, 0.0164 ),
	vec3( 0.3293, 0.9195, 0.0880 ),
	vec3( 0.0433, 0.0113, 0.8956 )
);
vec3 agxDefaultContrastApprox( vec3 x ) {
	vec3 x2 = x * x;
	vec3 x4 = x2 * x2;
	return + 15.5 * x4 * x2
		- 40.14 * x4 * x
		+ 31.96 * x4
		- 6.868 * x2 * x
		+ 0.4298 * x2
		+ 0.1191 * x
		- 0.00232;
}
vec3 AgXToneMapping( vec3 color ) {
	const mat3 AgXInsetMatrix = mat3(
		vec3( 0.856627153315983, 0.137318972929847, 0.11189821299995 ),
		vec3( 0.0951212405381588, 0.761241990602591, 0.0767994186031903 ),
		vec3( 0.0482516061458583, 0.101439036467562, 0.811302368396859 )
	);
	const mat3 AgXOutsetMatrix = mat3(
		vec3( 1.1271005818144368, - 0.1413297634984383, - 0.14132976349843826 ),
		vec3( - 0.11060664309660323, 1.157823702216272, - 0.11060664309660294 ),
		vec3( - 0.016493938717834573, - 0.016493938717834257, 1.2519364065950405 )
	);
	const float AgxMinEv = - 12.47393;	const float AgxMaxEv = 4.026069;
	color *= toneMappingExposure;
	color = LINEAR_SRGB_TO_LINEAR_REC2020 * color;
	color = AgXInsetMatrix * color;
	color = max( color, 1e-10 );	color = log2( color );
	color = ( color - AgxMinEv ) / ( AgxMaxEv - AgxMinEv );
	color = clamp( color, 0.0, 1.0 );
	color = agxDefaultContrastApprox( color );
	color = AgXOutsetMatrix * color;
	color = pow( max( vec3( 0.0 ), color ), vec3( 2.2 ) );
	color = LINEAR_REC2020_TO_LINEAR_SRGB * color;
	color = clamp( color, 0.0, 1.0 );
	return color;
}
vec3 NeutralToneMapping( vec3 color ) {
	const float StartCompression = 0.8 - 0.04;
	const float Desaturation = 0.15;
	color *= toneMappingExposure;
	float x = min( color.r, min( color.g, color.b ) );
	float offset = x < 0.08 ? x - 6.25 * x * x : 0.04;
	color -= offset;
	float peak = max( color.r, max( color.g, color.b ) );
	if ( peak < StartCompression ) return color;
	float d = 1. - StartCompression;
	float newPeak = 1. - d * d / ( peak + d - StartCompression );
	color *= newPeak / peak;
	float g = 1. - 1. / ( Desaturation * ( peak - newPeak ) + 1. );
	return mix( color, vec3( newPeak ), g );
}
vec3 CustomToneMapping( vec3 color ) { return color; }`,Ox=`#ifdef USE_TRANSMISSION
	material.transmission = transmission;
	material.transmissionAlpha = 1.0;
	material.thickness = thickness;
	material.attenuationDistance = attenuationDistance;
	material.attenuationColor = attenuationColor;
	#ifdef USE_TRANSMISSIONMAP
		material.transmission *= texture2D( transmissionMap, vTransmissionMapUv ).r;
	#endif
	#ifdef USE_THICKNESSMAP
		material.thickness *= texture2D( thicknessMap, vThicknessMapUv ).g;
	#endif
	vec3 pos = vWorldPosition;
	vec3 v = normalize( cameraPosition - pos );
	vec3 n = transformNormalByInverseViewMatrix( normal, viewMatrix );
	vec4 transmitted = getIBLVolumeRefraction(
		n, v, material.roughness, material.diffuseContribution, material.specularColorBlended, material.specularF90,
		pos, modelMatrix, viewMatrix, projectionMatrix, material.dispersion, material.ior, material.thickness,
		material.attenuationColor, material.attenuationDistance );
	material.transmissionAlpha = mix( material.transmissionAlpha, transmitted.a, material.transmission );
	totalDiffuse = mix( totalDiffuse, transmitted.rgb, material.transmission );
#endif`,Fx=`#ifdef USE_TRANSMISSION
	uniform float transmission;
	uniform float thickness;
	uniform float attenuationDistance;
	uniform vec3 attenuationColor;
	#ifdef USE_TRANSMISSIONMAP
		uniform sampler2D transmissionMap;
	#endif
	#ifdef USE_THICKNESSMAP
		uniform sampler2D thicknessMap;
	#endif
	uniform vec2 transmissionSamplerSize;
	uniform sampler2D transmissionSamplerMap;
	uniform mat4 modelMatrix;
	uniform mat4 projectionMatrix;
	varying vec3 vWorldPosition;
	float w0( float a ) {
		return ( 1.0 / 6.0 ) * ( a * ( a * ( - a + 3.0 ) - 3.0 ) + 1.0 );
	}
	float w1( float a ) {
		return ( 1.0 / 6.0 ) * ( a *  a * ( 3.0 * a - 6.0 ) + 4.0 );
	}
	float w2( float a ){
		return ( 1.0 / 6.0 ) * ( a * ( a * ( - 3.0 * a + 3.0 ) + 3.0 ) + 1.0 );
	}
	float w3( float a ) {
		return ( 1.0 / 6.0 ) * ( a * a * a );
	}
	float g0( float a ) {
		return w0( a ) + w1( a );
	}
	float g1( float a ) {
		return w2( a ) + w3( a );
	}
	float h0( float a ) {
		return - 1.0 + w1( a ) / ( w0( a ) + w1( a ) );
	}
	float h1( float a ) {
		return 1.0 + w3( a ) / ( w2( a ) + w3( a ) );
	}
	vec4 bicubic( sampler2D tex, vec2 uv, vec4 texelSize, float lod ) {
		uv = uv * texelSize.zw + 0.5;
		vec2 iuv = floor( uv );
		vec2 fuv = fract( uv );
		float g0x = g0( fuv.x );
		float g1x = g1( fuv.x );
		float h0x = h0( fuv.x );
		float h1x = h1( fuv.x );
		float h0y = h0( fuv.y );
		float h1y = h1( fuv.y );
		vec2 p0 = ( vec2( iuv.x + h0x, iuv.y + h0y ) - 0.5 ) * texelSize.xy;
		vec2 p1 = ( vec2( iuv.x + h1x, iuv.y + h0y ) - 0.5 ) * texelSize.xy;
		vec2 p2 = ( vec2( iuv.x + h0x, iuv.y + h1y ) - 0.5 ) * texelSize.xy;
		vec2 p3 = ( vec2( iuv.x + h1x, iuv.y + h1y ) - 0.5 ) * texelSize.xy;
		return g0( fuv.y ) * ( g0x * textureLod( tex, p0, lod ) + g1x * textureLod( tex, p1, lod ) ) +
			g1( fuv.y ) * ( g0x * textureLod( tex, p2, lod ) + g1x * textureLod( tex, p3, lod ) );
	}
	vec4 textureBicubic( sampler2D sampler, vec2 uv, float lod ) {
		vec2 fLodSize = vec2( textureSize( sampler, int( lod ) ) );
		vec2 cLodSize = vec2( textureSize( sampler, int( lod + 1.0 ) ) );
		vec2 fLodSizeInv = 1.0 / fLodSize;
		vec2 cLodSizeInv = 1.0 / cLodSize;
		vec4 fSample = bicubic( sampler, uv, vec4( fLodSizeInv, fLodSize ), floor( lod ) );
		vec4 cSample = bicubic( sampler, uv, vec4( cLodSizeInv, cLodSize ), ceil( lod ) );
		return mix( fSample, cSample, fract( lod ) );
	}
	vec3 getVolumeTransmissionRay( const in vec3 n, const in vec3 v, const in float thickness, const in float ior, const in mat4 modelMatrix ) {
		vec3 refractionVector = refract( - v, normalize( n ), 1.0 / ior );
		vec3 modelScale;
		modelScale.x = length( vec3( modelMatrix[ 0 ].xyz ) );
		modelScale.y = length( vec3( modelMatrix[ 1 ].xyz ) );
		modelScale.z = length( vec3( modelMatrix[ 2 ].xyz ) );
		return normalize( refractionVector ) * thickness * modelScale;
	}
	float applyIorToRoughness( const in float roughness, const in float ior ) {
		return roughness * clamp( ior * 2.0 - 2.0, 0.0, 1.0 );
	}
	vec4 getTransmissionSample( const in vec2 fragCoord, const in float roughness, const in float ior ) {
		float lod = log2( transmissionSamplerSize.x ) * applyIorToRoughness( roughness, ior );
		return textureBicubic( transmissionSamplerMap, fragCoord.xy, lod );
	}
	vec3 volumeAttenuation( const in float transmissionDistance, const in vec3 attenuationColor, const in float attenuationDistance ) {
		if ( isinf( attenuationDistance ) ) {
			return vec3( 1.0 );
		} else {
			vec3 attenuationCoefficient = -log( attenuationColor ) / attenuationDistance;
			vec3 transmittance = exp( - attenuationCoefficient * transmissionDistance );			return transmittance;
		}
	}
	vec4 getIBLVolumeRefraction( const in vec3 n, const in vec3 v, const in float roughness, const in vec3 diffuseColor,
		const in vec3 specularColor, const in float specularF90, const in vec3 position, const in mat4 modelMatrix,
		const in mat4 viewMatrix, const in mat4 projMatrix, const in float dispersion, const in float ior, const in float thickness,
		const in vec3 attenuationColor, const in float attenuationDistance ) {
		vec4 transmittedLight;
		vec3 transmittance;
		#ifdef USE_DISPERSION
			float halfSpread = ( ior - 1.0 ) * 0.025 * dispersion;
			vec3 iors = vec3( ior - halfSpread, ior, ior + halfSpread );
			for ( int i = 0; i < 3; i ++ ) {
				vec3 transmissionRay = getVolumeTransmissionRay( n, v, thickness, iors[ i ], modelMatrix );
				vec3 refractedRayExit = position + transmissionRay;
				vec4 ndcPos = projMatrix * viewMatrix * vec4( refractedRayExit, 1.0 );
				vec2 refractionCoords = ndcPos.xy / ndcPos.w;
				refractionCoords += 1.0;
				refractionCoords /= 2.0;
				vec4 transmissionSample = getTransmissionSample( refractionCoords, roughness, iors[ i ] );
				transmittedLight[ i ] = transmissionSample[ i ];
				transmittedLight.a += transmissionSample.a;
				transmittance[ i ] = diffuseColor[ i ] * volumeAttenuation( length( transmissionRay ), attenuationColor, attenuationDistance )[ i ];
			}
			transmittedLight.a /= 3.0;
		#else
			vec3 transmissionRay = getVolumeTransmissionRay( n, v, thickness, ior, modelMatrix );
			vec3 refractedRayExit = position + transmissionRay;
			vec4 ndcPos = projMatrix * viewMatrix * vec4( refractedRayExit, 1.0 );
			vec2 refractionCoords = ndcPos.xy / ndcPos.w;
			refractionCoords += 1.0;
			refractionCoords /= 2.0;
			transmittedLight = getTransmissionSample( refractionCoords, roughness, ior );
			transmittance = diffuseColor * volumeAttenuation( length( transmissionRay ), attenuationColor, attenuationDistance );
		#endif
		vec3 attenuatedColor = transmittance * transmittedLight.rgb;
		vec3 F = EnvironmentBRDF( n, v, specularColor, specularF90, roughness );
		float transmittanceFactor = ( transmittance.r + transmittance.g + transmittance.b ) / 3.0;
		return vec4( ( 1.0 - F ) * attenuatedColor, 1.0 - ( 1.0 - transmittedLight.a ) * transmittanceFactor );
	}
#endif`,kx=`#if defined( USE_UV ) || defined( USE_ANISOTROPY )
	varying vec2 vUv;
#endif
#ifdef USE_MAP
	varying vec2 vMapUv;
#endif
#ifdef USE_ALPHAMAP
	varying vec2 vAlphaMapUv;
#endif
#ifdef USE_LIGHTMAP
	varying vec2 vLightMapUv;
#endif
#ifdef USE_AOMAP
	varying vec2 vAoMapUv;
#endif
#ifdef USE_BUMPMAP
	varying vec2 vBumpMapUv;
#endif
#ifdef USE_NORMALMAP
	varying vec2 vNormalMapUv;
#endif
#ifdef USE_EMISSIVEMAP
	varying vec2 vEmissiveMapUv;
#endif
#ifdef USE_METALNESSMAP
	varying vec2 vMetalnessMapUv;
#endif
#ifdef USE_ROUGHNESSMAP
	varying vec2 vRoughnessMapUv;
#endif
#ifdef USE_DIFFUSE_ROUGHNESSMAP
	varying vec2 vDiffuseRoughnessMapUv;
#endif
#ifdef USE_ANISOTROPYMAP
	varying vec2 vAnisotropyMapUv;
#endif
#ifdef USE_CLEARCOATMAP
	varying vec2 vClearcoatMapUv;
#endif
#ifdef USE_CLEARCOAT_NORMALMAP
	varying vec2 vClearcoatNormalMapUv;
#endif
#ifdef USE_CLEARCOAT_ROUGHNESSMAP
	varying vec2 vClearcoatRoughnessMapUv;
#endif
#ifdef USE_IRIDESCENCEMAP
	varying vec2 vIridescenceMapUv;
#endif
#ifdef USE_IRIDESCENCE_THICKNESSMAP
	varying vec2 vIridescenceThicknessMapUv;
#endif
#ifdef USE_SHEEN_COLORMAP
	varying vec2 vSheenColorMapUv;
#endif
#ifdef USE_SHEEN_ROUGHNESSMAP
	varying vec2 vSheenRoughnessMapUv;
#endif
#ifdef USE_SPECULARMAP
	varying vec2 vSpecularMapUv;
#endif
#ifdef USE_SPECULAR_COLORMAP
	varying vec2 vSpecularColorMapUv;
#endif
#ifdef USE_SPECULAR_INTENSITYMAP
	varying vec2 vSpecularIntensityMapUv;
#endif
#ifdef USE_TRANSMISSIONMAP
	uniform mat3 transmissionMapTransform;
	varying vec2 vTransmissionMapUv;
#endif
#ifdef USE_THICKNESSMAP
	uniform mat3 thicknessMapTransform;
	varying vec2 vThicknessMapUv;
#endif`,Bx=`#if defined( USE_UV ) || defined( USE_ANISOTROPY )
	varying vec2 vUv;
#endif
#ifdef USE_MAP
	uniform mat3 mapTransform;
	varying vec2 vMapUv;
#endif
#ifdef USE_ALPHAMAP
	uniform mat3 alphaMapTransform;
	varying vec2 vAlphaMapUv;
#endif
#ifdef USE_LIGHTMAP
	uniform mat3 lightMapTransform;
	varying vec2 vLightMapUv;
#endif
#ifdef USE_AOMAP
	uniform mat3 aoMapTransform;
	varying vec2 vAoMapUv;
#endif
#ifdef USE_BUMPMAP
	uniform mat3 bumpMapTransform;
	varying vec2 vBumpMapUv;
#endif
#ifdef USE_NORMALMAP
	uniform mat3 normalMapTransform;
	varying vec2 vNormalMapUv;
#endif
#ifdef USE_DISPLACEMENTMAP
	uniform mat3 displacementMapTransform;
	varying vec2 vDisplacementMapUv;
#endif
#ifdef USE_EMISSIVEMAP
	uniform mat3 emissiveMapTransform;
	varying vec2 vEmissiveMapUv;
#endif
#ifdef USE_METALNESSMAP
	uniform mat3 metalnessMapTransform;
	varying vec2 vMetalnessMapUv;
#endif
#ifdef USE_ROUGHNESSMAP
	uniform mat3 roughnessMapTransform;
	varying vec2 vRoughnessMapUv;
#endif
#ifdef USE_DIFFUSE_ROUGHNESSMAP
	uniform mat3 diffuseRoughnessMapTransform;
	varying vec2 vDiffuseRoughnessMapUv;
#endif
#ifdef USE_ANISOTROPYMAP
	uniform mat3 anisotropyMapTransform;
	varying vec2 vAnisotropyMapUv;
#endif
#ifdef USE_CLEARCOATMAP
	uniform mat3 clearcoatMapTransform;
	varying vec2 vClearcoatMapUv;
#endif
#ifdef USE_CLEARCOAT_NORMALMAP
	uniform mat3 clearcoatNormalMapTransform;
	varying vec2 vClearcoatNormalMapUv;
#endif
#ifdef USE_CLEARCOAT_ROUGHNESSMAP
	uniform mat3 clearcoatRoughnessMapTransform;
	varying vec2 vClearcoatRoughnessMapUv;
#endif
#ifdef USE_SHEEN_COLORMAP
	uniform mat3 sheenColorMapTransform;
	varying vec2 vSheenColorMapUv;
#endif
#ifdef USE_SHEEN_ROUGHNESSMAP
	uniform mat3 sheenRoughnessMapTransform;
	varying vec2 vSheenRoughnessMapUv;
#endif
#ifdef USE_IRIDESCENCEMAP
	uniform mat3 iridescenceMapTransform;
	varying vec2 vIridescenceMapUv;
#endif
#ifdef USE_IRIDESCENCE_THICKNESSMAP
	uniform mat3 iridescenceThicknessMapTransform;
	varying vec2 vIridescenceThicknessMapUv;
#endif
#ifdef USE_SPECULARMAP
	uniform mat3 specularMapTransform;
	varying vec2 vSpecularMapUv;
#endif
#ifdef USE_SPECULAR_COLORMAP
	uniform mat3 specularColorMapTransform;
	varying vec2 vSpecularColorMapUv;
#endif
#ifdef USE_SPECULAR_INTENSITYMAP
	uniform mat3 specularIntensityMapTransform;
	varying vec2 vSpecularIntensityMapUv;
#endif
#ifdef USE_TRANSMISSIONMAP
	uniform mat3 transmissionMapTransform;
	varying vec2 vTransmissionMapUv;
#endif
#ifdef USE_THICKNESSMAP
	uniform mat3 thicknessMapTransform;
	varying vec2 vThicknessMapUv;
#endif`,zx=`#if defined( USE_UV ) || defined( USE_ANISOTROPY )
	vUv = vec3( uv, 1 ).xy;
#endif
#ifdef USE_MAP
	vMapUv = ( mapTransform * vec3( MAP_UV, 1 ) ).xy;
#endif
#ifdef USE_ALPHAMAP
	vAlphaMapUv = ( alphaMapTransform * vec3( ALPHAMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_LIGHTMAP
	vLightMapUv = ( lightMapTransform * vec3( LIGHTMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_AOMAP
	vAoMapUv = ( aoMapTransform * vec3( AOMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_BUMPMAP
	vBumpMapUv = ( bumpMapTransform * vec3( BUMPMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_NORMALMAP
	vNormalMapUv = ( normalMapTransform * vec3( NORMALMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_DISPLACEMENTMAP
	vDisplacementMapUv = ( displacementMapTransform * vec3( DISPLACEMENTMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_EMISSIVEMAP
	vEmissiveMapUv = ( emissiveMapTransform * vec3( EMISSIVEMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_METALNESSMAP
	vMetalnessMapUv = ( metalnessMapTransform * vec3( METALNESSMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_ROUGHNESSMAP
	vRoughnessMapUv = ( roughnessMapTransform * vec3( ROUGHNESSMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_DIFFUSE_ROUGHNESSMAP
	vDiffuseRoughnessMapUv = ( diffuseRoughnessMapTransform * vec3( DIFFUSE_ROUGHNESSMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_ANISOTROPYMAP
	vAnisotropyMapUv = ( anisotropyMapTransform * vec3( ANISOTROPYMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_CLEARCOATMAP
	vClearcoatMapUv = ( clearcoatMapTransform * vec3( CLEARCOATMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_CLEARCOAT_NORMALMAP
	vClearcoatNormalMapUv = ( clearcoatNormalMapTransform * vec3( CLEARCOAT_NORMALMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_CLEARCOAT_ROUGHNESSMAP
	vClearcoatRoughnessMapUv = ( clearcoatRoughnessMapTransform * vec3( CLEARCOAT_ROUGHNESSMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_IRIDESCENCEMAP
	vIridescenceMapUv = ( iridescenceMapTransform * vec3( IRIDESCENCEMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_IRIDESCENCE_THICKNESSMAP
	vIridescenceThicknessMapUv = ( iridescenceThicknessMapTransform * vec3( IRIDESCENCE_THICKNESSMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_SHEEN_COLORMAP
	vSheenColorMapUv = ( sheenColorMapTransform * vec3( SHEEN_COLORMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_SHEEN_ROUGHNESSMAP
	vSheenRoughnessMapUv = ( sheenRoughnessMapTransform * vec3( SHEEN_ROUGHNESSMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_SPECULARMAP
	vSpecularMapUv = ( specularMapTransform * vec3( SPECULARMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_SPECULAR_COLORMAP
	vSpecularColorMapUv = ( specularColorMapTransform * vec3( SPECULAR_COLORMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_SPECULAR_INTENSITYMAP
	vSpecularIntensityMapUv = ( specularIntensityMapTransform * vec3( SPECULAR_INTENSITYMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_TRANSMISSIONMAP
	vTransmissionMapUv = ( transmissionMapTransform * vec3( TRANSMISSIONMAP_UV, 1 ) ).xy;
#endif
#ifdef USE_THICKNESSMAP
	vThicknessMapUv = ( thicknessMapTransform * vec3( THICKNESSMAP_UV, 1 ) ).xy;
#endif`,Vx=`#if defined( USE_ENVMAP ) || defined( DISTANCE ) || defined ( USE_SHADOWMAP ) || defined ( USE_TRANSMISSION ) || NUM_SPOT_LIGHT_COORDS > 0
	vec4 worldPosition = vec4( transformed, 1.0 );
	#ifdef USE_BATCHING
		worldPosition = batchingMatrix * worldPosition;
	#endif
	#ifdef USE_INSTANCING
		worldPosition = instanceMatrix * worldPosition;
	#endif
	worldPosition = modelMatrix * worldPosition;
#endif`;const Hx=`varying vec2 vUv;
uniform mat3 uvTransform;
void main() {
	vUv = ( uvTransform * vec3( uv, 1 ) ).xy;
	gl_Position = vec4( position.xy, 1.0, 1.0 );
}`,Gx=`uniform sampler2D t2D;
uniform float backgroundIntensity;
varying vec2 vUv;
void main() {
	vec4 texColor = texture2D( t2D, vUv );
	#ifdef DECODE_VIDEO_TEXTURE
		texColor = vec4( mix( pow( texColor.rgb * 0.9478672986 + vec3( 0.0521327014 ), vec3( 2.4 ) ), texColor.rgb * 0.0773993808, vec3( lessThanEqual( texColor.rgb, vec3( 0.04045 ) ) ) ), texColor.w );
	#endif
	texColor.rgb *= backgroundIntensity;
	gl_FragColor = texColor;
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
}`,Wx=`varying vec3 vWorldDirection;
#include <common>
void main() {
	vWorldDirection = transformDirection( position, modelMatrix );
	#include <begin_vertex>
	#include <project_vertex>
	gl_Position.z = gl_Position.w;
}`,Xx=`uniform float backgroundBlurriness;
uniform float backgroundIntensity;
uniform mat3 backgroundRotation;
varying vec3 vWorldDirection;
#include <envmap_common_pars_fragment>
void main() {
	#ifdef ENVMAP_TYPE_PMREM
		vec4 texColor = textureLod( envMap, backgroundRotation * vWorldDirection, roughnessToMip( backgroundBlurriness ) );
	#else
		vec4 texColor = textureCube( envMap, backgroundRotation * vWorldDirection );
	#endif
	texColor.rgb *= backgroundIntensity;
	gl_FragColor = texColor;
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
}`,qx=`varying vec3 vWorldDirection;
#include <common>
void main() {
	vWorldDirection = transformDirection( position, modelMatrix );
	#include <begin_vertex>
	#include <project_vertex>
	gl_Position.z = gl_Position.w;
}`,$x=`uniform samplerCube tCube;
uniform float tFlip;
uniform float opacity;
varying vec3 vWorldDirection;
void main() {
	vec4 texColor = textureCube( tCube, vec3( tFlip * vWorldDirection.x, vWorldDirection.yz ) );
	gl_FragColor = texColor;
	gl_FragColor.a *= opacity;
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
}`,Yx=`#include <common>
#include <batching_pars_vertex>
#include <uv_pars_vertex>
#include <displacementmap_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
varying vec2 vHighPrecisionZW;
void main() {
	#include <uv_vertex>
	#include <batching_vertex>
	#include <skinbase_vertex>
	#include <morphinstance_vertex>
	#ifdef USE_DISPLACEMENTMAP
		#include <beginnormal_vertex>
		#include <morphnormal_vertex>
		#include <skinnormal_vertex>
	#endif
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <skinning_vertex>
	#include <displacementmap_vertex>
	#include <project_vertex>
	#include <logdepthbuf_vertex>
	#include <clipping_planes_vertex>
	vHighPrecisionZW = gl_Position.zw;
}`,Kx=`#if DEPTH_PACKING == 3200
	uniform float opacity;
#endif
#include <common>
#include <packing>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <alphamap_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
varying vec2 vHighPrecisionZW;
void main() {
	vec4 diffuseColor = vec4( 1.0 );
	#include <clipping_planes_fragment>
	#if DEPTH_PACKING == 3200
		diffuseColor.a = opacity;
	#endif
	#include <map_fragment>
	#include <alphamap_fragment>
	#include <alphatest_fragment>
	#include <alphahash_fragment>
	#include <logdepthbuf_fragment>
	#ifdef USE_REVERSED_DEPTH_BUFFER
		float fragCoordZ = vHighPrecisionZW[ 0 ] / vHighPrecisionZW[ 1 ];
	#else
		float fragCoordZ = 0.5 * vHighPrecisionZW[ 0 ] / vHighPrecisionZW[ 1 ] + 0.5;
	#endif
	#if DEPTH_PACKING == 3200
		gl_FragColor = vec4( vec3( 1.0 - fragCoordZ ), opacity );
	#elif DEPTH_PACKING == 3201
		gl_FragColor = packDepthToRGBA( fragCoordZ );
	#elif DEPTH_PACKING == 3202
		gl_FragColor = vec4( packDepthToRGB( fragCoordZ ), 1.0 );
	#elif DEPTH_PACKING == 3203
		gl_FragColor = vec4( packDepthToRG( fragCoordZ ), 0.0, 1.0 );
	#endif
}`,Zx=`#define DISTANCE
varying vec3 vWorldPosition;
#include <common>
#include <batching_pars_vertex>
#include <uv_pars_vertex>
#include <displacementmap_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <clipping_planes_pars_vertex>
void main() {
	#include <uv_vertex>
	#include <batching_vertex>
	#include <skinbase_vertex>
	#include <morphinstance_vertex>
	#ifdef USE_DISPLACEMENTMAP
		#include <beginnormal_vertex>
		#include <morphnormal_vertex>
		#include <skinnormal_vertex>
	#endif
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <skinning_vertex>
	#include <displacementmap_vertex>
	#include <project_vertex>
	#include <worldpos_vertex>
	#include <clipping_planes_vertex>
	vWorldPosition = worldPosition.xyz;
}`,jx=`#define DISTANCE
uniform vec3 referencePosition;
uniform float nearDistance;
uniform float farDistance;
varying vec3 vWorldPosition;
#include <common>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <alphamap_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <clipping_planes_pars_fragment>
void main() {
	vec4 diffuseColor = vec4( 1.0 );
	#include <clipping_planes_fragment>
	#include <map_fragment>
	#include <alphamap_fragment>
	#include <alphatest_fragment>
	#include <alphahash_fragment>
	float dist = length( vWorldPosition - referencePosition );
	dist = ( dist - nearDistance ) / ( farDistance - nearDistance );
	dist = saturate( dist );
	gl_FragColor = vec4( dist, 0.0, 0.0, 1.0 );
}`,Qx=`varying vec3 vWorldDirection;
#include <common>
void main() {
	vWorldDirection = transformDirection( position, modelMatrix );
	#include <begin_vertex>
	#include <project_vertex>
}`,Jx=`uniform sampler2D tEquirect;
varying vec3 vWorldDirection;
#include <common>
void main() {
	vec3 direction = normalize( vWorldDirection );
	vec2 sampleUV = equirectUv( direction );
	gl_FragColor = texture2D( tEquirect, sampleUV );
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
}`,tb=`uniform float scale;
attribute float lineDistance;
varying float vLineDistance;
#include <common>
#include <uv_pars_vertex>
#include <color_pars_vertex>
#include <fog_pars_vertex>
#include <morphtarget_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
void main() {
	vLineDistance = scale * lineDistance;
	#include <uv_vertex>
	#include <color_vertex>
	#include <morphinstance_vertex>
	#include <morphcolor_vertex>
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <project_vertex>
	#include <logdepthbuf_vertex>
	#include <clipping_planes_vertex>
	#include <fog_vertex>
}`,eb=`uniform vec3 diffuse;
uniform float opacity;
uniform float dashSize;
uniform float totalSize;
varying float vLineDistance;
#include <common>
#include <color_pars_fragment>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <fog_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main() {
	vec4 diffuseColor = vec4( diffuse, opacity );
	#include <clipping_planes_fragment>
	if ( mod( vLineDistance, totalSize ) > dashSize ) {
		discard;
	}
	vec3 outgoingLight = vec3( 0.0 );
	#include <logdepthbuf_fragment>
	#include <map_fragment>
	#include <color_fragment>
	outgoingLight = diffuseColor.rgb;
	#include <opaque_fragment>
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
	#include <fog_fragment>
	#include <premultiplied_alpha_fragment>
}`,nb=`#include <common>
#include <batching_pars_vertex>
#include <uv_pars_vertex>
#include <envmap_pars_vertex>
#include <color_pars_vertex>
#include <fog_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
void main() {
	#include <uv_vertex>
	#include <color_vertex>
	#include <morphinstance_vertex>
	#include <morphcolor_vertex>
	#include <batching_vertex>
	#if defined ( USE_ENVMAP ) || defined ( USE_SKINNING )
		#include <beginnormal_vertex>
		#include <morphnormal_vertex>
		#include <skinbase_vertex>
		#include <skinnormal_vertex>
		#include <defaultnormal_vertex>
	#endif
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <skinning_vertex>
	#include <project_vertex>
	#include <logdepthbuf_vertex>
	#include <clipping_planes_vertex>
	#include <worldpos_vertex>
	#include <envmap_vertex>
	#include <fog_vertex>
}`,ib=`uniform vec3 diffuse;
uniform float opacity;
#ifndef FLAT_SHADED
	varying vec3 vNormal;
#endif
#include <common>
#include <dithering_pars_fragment>
#include <color_pars_fragment>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <alphamap_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <aomap_pars_fragment>
#include <lightmap_pars_fragment>
#include <envmap_common_pars_fragment>
#include <envmap_pars_fragment>
#include <fog_pars_fragment>
#include <specularmap_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main() {
	vec4 diffuseColor = vec4( diffuse, opacity );
	#include <clipping_planes_fragment>
	#include <logdepthbuf_fragment>
	#include <map_fragment>
	#include <color_fragment>
	#include <alphamap_fragment>
	#include <alphatest_fragment>
	#include <alphahash_fragment>
	#include <specularmap_fragment>
	ReflectedLight reflectedLight = ReflectedLight( vec3( 0.0 ), vec3( 0.0 ), vec3( 0.0 ), vec3( 0.0 ) );
	#ifdef USE_LIGHTMAP
		vec4 lightMapTexel = texture2D( lightMap, vLightMapUv );
		reflectedLight.indirectDiffuse += lightMapTexel.rgb * lightMapIntensity * RECIPROCAL_PI;
	#else
		reflectedLight.indirectDiffuse += vec3( 1.0 );
	#endif
	#include <aomap_fragment>
	reflectedLight.indirectDiffuse *= diffuseColor.rgb;
	vec3 outgoingLight = reflectedLight.indirectDiffuse;
	#include <envmap_fragment>
	#include <opaque_fragment>
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
	#include <fog_fragment>
	#include <premultiplied_alpha_fragment>
	#include <dithering_fragment>
}`,sb=`#define LAMBERT
varying vec3 vViewPosition;
#include <common>
#include <batching_pars_vertex>
#include <uv_pars_vertex>
#include <displacementmap_pars_vertex>
#include <envmap_pars_vertex>
#include <color_pars_vertex>
#include <fog_pars_vertex>
#include <normal_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <shadowmap_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
void main() {
	#include <uv_vertex>
	#include <color_vertex>
	#include <morphinstance_vertex>
	#include <morphcolor_vertex>
	#include <batching_vertex>
	#include <beginnormal_vertex>
	#include <morphnormal_vertex>
	#include <skinbase_vertex>
	#include <skinnormal_vertex>
	#include <defaultnormal_vertex>
	#include <normal_vertex>
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <skinning_vertex>
	#include <displacementmap_vertex>
	#include <project_vertex>
	#include <logdepthbuf_vertex>
	#include <clipping_planes_vertex>
	vViewPosition = - mvPosition.xyz;
	#include <worldpos_vertex>
	#include <envmap_vertex>
	#include <shadowmap_vertex>
	#include <fog_vertex>
}`,rb=`#define LAMBERT
uniform vec3 diffuse;
uniform vec3 emissive;
uniform float opacity;
#include <common>
#include <dithering_pars_fragment>
#include <color_pars_fragment>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <alphamap_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <aomap_pars_fragment>
#include <lightmap_pars_fragment>
#include <emissivemap_pars_fragment>
#include <envmap_common_pars_fragment>
#include <envmap_pars_fragment>
#include <envmap_physical_pars_fragment>
#include <fog_pars_fragment>
#include <bsdfs>
#include <lights_pars_begin>
#include <normal_pars_fragment>
#include <lights_lambert_pars_fragment>
#include <shadowmap_pars_fragment>
#include <bumpmap_pars_fragment>
#include <normalmap_pars_fragment>
#include <specularmap_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main() {
	vec4 diffuseColor = vec4( diffuse, opacity );
	#include <clipping_planes_fragment>
	ReflectedLight reflectedLight = ReflectedLight( vec3( 0.0 ), vec3( 0.0 ), vec3( 0.0 ), vec3( 0.0 ) );
	vec3 totalEmissiveRadiance = emissive;
	#include <logdepthbuf_fragment>
	#include <map_fragment>
	#include <color_fragment>
	#include <alphamap_fragment>
	#include <alphatest_fragment>
	#include <alphahash_fragment>
	#include <specularmap_fragment>
	#include <normal_fragment_begin>
	#include <normal_fragment_maps>
	#include <emissivemap_fragment>
	#include <lights_lambert_fragment>
	#include <lights_fragment_begin>
	#include <lights_fragment_maps>
	#include <lights_fragment_end>
	#include <aomap_fragment>
	vec3 outgoingLight = reflectedLight.directDiffuse + reflectedLight.indirectDiffuse + totalEmissiveRadiance;
	#include <envmap_fragment>
	#include <opaque_fragment>
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
	#include <fog_fragment>
	#include <premultiplied_alpha_fragment>
	#include <dithering_fragment>
}`,ob=`#define MATCAP
varying vec3 vViewPosition;
#include <common>
#include <batching_pars_vertex>
#include <uv_pars_vertex>
#include <color_pars_vertex>
#include <displacementmap_pars_vertex>
#include <fog_pars_vertex>
#include <normal_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
void main() {
	#include <uv_vertex>
	#include <color_vertex>
	#include <morphinstance_vertex>
	#include <morphcolor_vertex>
	#include <batching_vertex>
	#include <beginnormal_vertex>
	#include <morphnormal_vertex>
	#include <skinbase_vertex>
	#include <skinnormal_vertex>
	#include <defaultnormal_vertex>
	#include <normal_vertex>
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <skinning_vertex>
	#include <displacementmap_vertex>
	#include <project_vertex>
	#include <logdepthbuf_vertex>
	#include <clipping_planes_vertex>
	#include <fog_vertex>
	vViewPosition = - mvPosition.xyz;
}`,ab=`#define MATCAP
uniform vec3 diffuse;
uniform float opacity;
uniform sampler2D matcap;
varying vec3 vViewPosition;
#include <common>
#include <dithering_pars_fragment>
#include <color_pars_fragment>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <alphamap_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <fog_pars_fragment>
#include <normal_pars_fragment>
#include <bumpmap_pars_fragment>
#include <normalmap_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main() {
	vec4 diffuseColor = vec4( diffuse, opacity );
	#include <clipping_planes_fragment>
	#include <logdepthbuf_fragment>
	#include <map_fragment>
	#include <color_fragment>
	#include <alphamap_fragment>
	#include <alphatest_fragment>
	#include <alphahash_fragment>
	#include <normal_fragment_begin>
	#include <normal_fragment_maps>
	vec3 viewDir = normalize( vViewPosition );
	vec3 x = normalize( vec3( viewDir.z, 0.0, - viewDir.x ) );
	vec3 y = cross( viewDir, x );
	vec2 uv = vec2( dot( x, normal ), dot( y, normal ) ) * 0.495 + 0.5;
	#ifdef USE_MATCAP
		vec4 matcapColor = texture2D( matcap, uv );
	#else
		vec4 matcapColor = vec4( vec3( mix( 0.2, 0.8, uv.y ) ), 1.0 );
	#endif
	vec3 outgoingLight = diffuseColor.rgb * matcapColor.rgb;
	#include <opaque_fragment>
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
	#include <fog_fragment>
	#include <premultiplied_alpha_fragment>
	#include <dithering_fragment>
}`,lb=`#define NORMAL
#if defined( FLAT_SHADED ) || defined( USE_BUMPMAP ) || defined( USE_NORMALMAP_TANGENTSPACE )
	varying vec3 vViewPosition;
#endif
#include <common>
#include <batching_pars_vertex>
#include <uv_pars_vertex>
#include <displacementmap_pars_vertex>
#include <normal_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
void main() {
	#include <uv_vertex>
	#include <batching_vertex>
	#include <beginnormal_vertex>
	#include <morphinstance_vertex>
	#include <morphnormal_vertex>
	#include <skinbase_vertex>
	#include <skinnormal_vertex>
	#include <defaultnormal_vertex>
	#include <normal_vertex>
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <skinning_vertex>
	#include <displacementmap_vertex>
	#include <project_vertex>
	#include <logdepthbuf_vertex>
	#include <clipping_planes_vertex>
#if defined( FLAT_SHADED ) || defined( USE_BUMPMAP ) || defined( USE_NORMALMAP_TANGENTSPACE )
	vViewPosition = - mvPosition.xyz;
#endif
}`,cb=`#define NORMAL
uniform float opacity;
#if defined( FLAT_SHADED ) || defined( USE_BUMPMAP ) || defined( USE_NORMALMAP_TANGENTSPACE )
	varying vec3 vViewPosition;
#endif
#include <uv_pars_fragment>
#include <normal_pars_fragment>
#include <bumpmap_pars_fragment>
#include <normalmap_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main() {
	vec4 diffuseColor = vec4( 0.0, 0.0, 0.0, opacity );
	#include <clipping_planes_fragment>
	#include <logdepthbuf_fragment>
	#include <normal_fragment_begin>
	#include <normal_fragment_maps>
	gl_FragColor = vec4( normalize( normal ) * 0.5 + 0.5, diffuseColor.a );
	#ifdef OPAQUE
		gl_FragColor.a = 1.0;
	#endif
}`,hb=`#define PHONG
varying vec3 vViewPosition;
#include <common>
#include <batching_pars_vertex>
#include <uv_pars_vertex>
#include <displacementmap_pars_vertex>
#include <envmap_pars_vertex>
#include <color_pars_vertex>
#include <fog_pars_vertex>
#include <normal_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <shadowmap_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
void main() {
	#include <uv_vertex>
	#include <color_vertex>
	#include <morphcolor_vertex>
	#include <batching_vertex>
	#include <beginnormal_vertex>
	#include <morphinstance_vertex>
	#include <morphnormal_vertex>
	#include <skinbase_vertex>
	#include <skinnormal_vertex>
	#include <defaultnormal_vertex>
	#include <normal_vertex>
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <skinning_vertex>
	#include <displacementmap_vertex>
	#include <project_vertex>
	#include <logdepthbuf_vertex>
	#include <clipping_planes_vertex>
	vViewPosition = - mvPosition.xyz;
	#include <worldpos_vertex>
	#include <envmap_vertex>
	#include <shadowmap_vertex>
	#include <fog_vertex>
}`,ub=`#define PHONG
uniform vec3 diffuse;
uniform vec3 emissive;
uniform vec3 specular;
uniform float shininess;
uniform float opacity;
#include <common>
#include <dithering_pars_fragment>
#include <color_pars_fragment>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <alphamap_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <aomap_pars_fragment>
#include <lightmap_pars_fragment>
#include <emissivemap_pars_fragment>
#include <envmap_common_pars_fragment>
#include <envmap_pars_fragment>
#include <envmap_physical_pars_fragment>
#include <fog_pars_fragment>
#include <bsdfs>
#include <lights_pars_begin>
#include <normal_pars_fragment>
#include <lights_phong_pars_fragment>
#include <shadowmap_pars_fragment>
#include <bumpmap_pars_fragment>
#include <normalmap_pars_fragment>
#include <specularmap_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main() {
	vec4 diffuseColor = vec4( diffuse, opacity );
	#include <clipping_planes_fragment>
	ReflectedLight reflectedLight = ReflectedLight( vec3( 0.0 ), vec3( 0.0 ), vec3( 0.0 ), vec3( 0.0 ) );
	vec3 totalEmissiveRadiance = emissive;
	#include <logdepthbuf_fragment>
	#include <map_fragment>
	#include <color_fragment>
	#include <alphamap_fragment>
	#include <alphatest_fragment>
	#include <alphahash_fragment>
	#include <specularmap_fragment>
	#include <normal_fragment_begin>
	#include <normal_fragment_maps>
	#include <emissivemap_fragment>
	#include <lights_phong_fragment>
	#include <lights_fragment_begin>
	#include <lights_fragment_maps>
	#include <lights_fragment_end>
	#include <aomap_fragment>
	vec3 outgoingLight = reflectedLight.directDiffuse + reflectedLight.indirectDiffuse + reflectedLight.directSpecular + reflectedLight.indirectSpecular + totalEmissiveRadiance;
	#include <envmap_fragment>
	#include <opaque_fragment>
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
	#include <fog_fragment>
	#include <premultiplied_alpha_fragment>
	#include <dithering_fragment>
}`,db=`#define STANDARD
varying vec3 vViewPosition;
#ifdef USE_TRANSMISSION
	varying vec3 vWorldPosition;
#endif
#include <common>
#include <batching_pars_vertex>
#include <uv_pars_vertex>
#include <displacementmap_pars_vertex>
#include <color_pars_vertex>
#include <fog_pars_vertex>
#include <normal_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <shadowmap_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
void main() {
	#include <uv_vertex>
	#include <color_vertex>
	#include <morphinstance_vertex>
	#include <morphcolor_vertex>
	#include <batching_vertex>
	#include <beginnormal_vertex>
	#include <morphnormal_vertex>
	#include <skinbase_vertex>
	#include <skinnormal_vertex>
	#include <defaultnormal_vertex>
	#include <normal_vertex>
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <skinning_vertex>
	#include <displacementmap_vertex>
	#include <project_vertex>
	#include <logdepthbuf_vertex>
	#include <clipping_planes_vertex>
	vViewPosition = - mvPosition.xyz;
	#include <worldpos_vertex>
	#include <shadowmap_vertex>
	#include <fog_vertex>
#ifdef USE_TRANSMISSION
	vWorldPosition = worldPosition.xyz;
#endif
}`,pb=`#define STANDARD
#ifdef PHYSICAL
	#define IOR
	#define USE_SPECULAR
#endif
uniform vec3 diffuse;
uniform vec3 emissive;
uniform float roughness;
uniform float metalness;
uniform float opacity;
#ifdef IOR
	uniform float ior;
#endif
#ifdef USE_SPECULAR
	uniform float specularIntensity;
	uniform vec3 specularColor;
	#ifdef USE_SPECULAR_COLORMAP
		uniform sampler2D specularColorMap;
	#endif
	#ifdef USE_SPECULAR_INTENSITYMAP
		uniform sampler2D specularIntensityMap;
	#endif
#endif
#ifdef USE_CLEARCOAT
	uniform float clearcoat;
	uniform float clearcoatRoughness;
#endif
#ifdef USE_DIFFUSE_ROUGHNESS
	uniform float diffuseRoughness;
	#ifdef USE_DIFFUSE_ROUGHNESSMAP
		uniform sampler2D diffuseRoughnessMap;
	#endif
#endif
#ifdef USE_DISPERSION
	uniform float dispersion;
#endif
#ifdef USE_RETROREFLECTION
	uniform float retroreflectivity;
#endif
#ifdef USE_IRIDESCENCE
	uniform float iridescence;
	uniform float iridescenceIOR;
	uniform float iridescenceThicknessMinimum;
	uniform float iridescenceThicknessMaximum;
#endif
#ifdef USE_SHEEN
	uniform vec3 sheenColor;
	uniform float sheenRoughness;
	#ifdef USE_SHEEN_COLORMAP
		uniform sampler2D sheenColorMap;
	#endif
	#ifdef USE_SHEEN_ROUGHNESSMAP
		uniform sampler2D sheenRoughnessMap;
	#endif
#endif
#ifdef USE_ANISOTROPY
	uniform vec2 anisotropyVector;
	#ifdef USE_ANISOTROPYMAP
		uniform sampler2D anisotropyMap;
	#endif
#endif
varying vec3 vViewPosition;
#include <common>
#include <dithering_pars_fragment>
#include <color_pars_fragment>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <alphamap_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <aomap_pars_fragment>
#include <lightmap_pars_fragment>
#include <emissivemap_pars_fragment>
#include <iridescence_fragment>
#include <envmap_common_pars_fragment>
#include <envmap_physical_pars_fragment>
#include <fog_pars_fragment>
#include <lights_pars_begin>
#include <normal_pars_fragment>
#include <lights_physical_pars_fragment>
#include <transmission_pars_fragment>
#include <shadowmap_pars_fragment>
#include <bumpmap_pars_fragment>
#include <normalmap_pars_fragment>
#include <clearcoat_pars_fragment>
#include <iridescence_pars_fragment>
#include <roughnessmap_pars_fragment>
#include <metalnessmap_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main() {
	vec4 diffuseColor = vec4( diffuse, opacity );
	#include <clipping_planes_fragment>
	ReflectedLight reflectedLight = ReflectedLight( vec3( 0.0 ), vec3( 0.0 ), vec3( 0.0 ), vec3( 0.0 ) );
	vec3 totalEmissiveRadiance = emissive;
	#include <logdepthbuf_fragment>
	#include <map_fragment>
	#include <color_fragment>
	#include <alphamap_fragment>
	#include <alphatest_fragment>
	#include <alphahash_fragment>
	#include <roughnessmap_fragment>
	#include <metalnessmap_fragment>
	#include <normal_fragment_begin>
	#include <normal_fragment_maps>
	#include <clearcoat_normal_fragment_begin>
	#include <clearcoat_normal_fragment_maps>
	#include <emissivemap_fragment>
	#include <lights_physical_fragment>
	#include <lights_fragment_begin>
	#include <lights_fragment_maps>
	#include <lights_fragment_end>
	#include <aomap_fragment>
	vec3 totalDiffuse = reflectedLight.directDiffuse + reflectedLight.indirectDiffuse;
	vec3 totalSpecular = reflectedLight.directSpecular + reflectedLight.indirectSpecular;
	#include <transmission_fragment>
	vec3 outgoingLight = totalDiffuse + totalSpecular + totalEmissiveRadiance;
	#ifdef USE_SHEEN
 
		outgoingLight = outgoingLight + sheenSpecularDirect + sheenSpecularIndirect;
 
 	#endif
	#ifdef USE_CLEARCOAT
		float dotNVcc = saturate( dot( geometryClearcoatNormal, geometryViewDir ) );
		vec3 Fcc = F_Schlick( material.clearcoatF0, material.clearcoatF90, dotNVcc );
		outgoingLight = outgoingLight * ( 1.0 - material.clearcoat * Fcc ) + ( clearcoatSpecularDirect + clearcoatSpecularIndirect ) * material.clearcoat;
	#endif
	#include <opaque_fragment>
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
	#include <fog_fragment>
	#include <premultiplied_alpha_fragment>
	#include <dithering_fragment>
}`,fb=`#define TOON
varying vec3 vViewPosition;
#include <common>
#include <batching_pars_vertex>
#include <uv_pars_vertex>
#include <displacementmap_pars_vertex>
#include <color_pars_vertex>
#include <fog_pars_vertex>
#include <normal_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <shadowmap_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
void main() {
	#include <uv_vertex>
	#include <color_vertex>
	#include <morphinstance_vertex>
	#include <morphcolor_vertex>
	#include <batching_vertex>
	#include <beginnormal_vertex>
	#include <morphnormal_vertex>
	#include <skinbase_vertex>
	#include <skinnormal_vertex>
	#include <defaultnormal_vertex>
	#include <normal_vertex>
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <skinning_vertex>
	#include <displacementmap_vertex>
	#include <project_vertex>
	#include <logdepthbuf_vertex>
	#include <clipping_planes_vertex>
	vViewPosition = - mvPosition.xyz;
	#include <worldpos_vertex>
	#include <shadowmap_vertex>
	#include <fog_vertex>
}`,mb=`#define TOON
uniform vec3 diffuse;
uniform vec3 emissive;
uniform float opacity;
#include <common>
#include <dithering_pars_fragment>
#include <color_pars_fragment>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <alphamap_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <aomap_pars_fragment>
#include <lightmap_pars_fragment>
#include <emissivemap_pars_fragment>
#include <gradientmap_pars_fragment>
#include <fog_pars_fragment>
#include <bsdfs>
#include <lights_pars_begin>
#include <normal_pars_fragment>
#include <lights_toon_pars_fragment>
#include <shadowmap_pars_fragment>
#include <bumpmap_pars_fragment>
#include <normalmap_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main() {
	vec4 diffuseColor = vec4( diffuse, opacity );
	#include <clipping_planes_fragment>
	ReflectedLight reflectedLight = ReflectedLight( vec3( 0.0 ), vec3( 0.0 ), vec3( 0.0 ), vec3( 0.0 ) );
	vec3 totalEmissiveRadiance = emissive;
	#include <logdepthbuf_fragment>
	#include <map_fragment>
	#include <color_fragment>
	#include <alphamap_fragment>
	#include <alphatest_fragment>
	#include <alphahash_fragment>
	#include <normal_fragment_begin>
	#include <normal_fragment_maps>
	#include <emissivemap_fragment>
	#include <lights_toon_fragment>
	#include <lights_fragment_begin>
	#include <lights_fragment_maps>
	#include <lights_fragment_end>
	#include <aomap_fragment>
	vec3 outgoingLight = reflectedLight.directDiffuse + reflectedLight.indirectDiffuse + totalEmissiveRadiance;
	#include <opaque_fragment>
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
	#include <fog_fragment>
	#include <premultiplied_alpha_fragment>
	#include <dithering_fragment>
}`,gb=`uniform float size;
uniform float scale;
#include <common>
#include <color_pars_vertex>
#include <fog_pars_vertex>
#include <morphtarget_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
#ifdef USE_POINTS_UV
	varying vec2 vUv;
	uniform mat3 uvTransform;
#endif
void main() {
	#ifdef USE_POINTS_UV
		vUv = ( uvTransform * vec3( uv, 1 ) ).xy;
	#endif
	#include <color_vertex>
	#include <morphinstance_vertex>
	#include <morphcolor_vertex>
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <project_vertex>
	gl_PointSize = size;
	#ifdef USE_SIZEATTENUATION
		bool isPerspective = isPerspectiveMatrix( projectionMatrix );
		if ( isPerspective ) gl_PointSize *= ( scale / - mvPosition.z );
	#endif
	#include <logdepthbuf_vertex>
	#include <clipping_planes_vertex>
	#include <worldpos_vertex>
	#include <fog_vertex>
}`,vb=`uniform vec3 diffuse;
uniform float opacity;
#include <common>
#include <color_pars_fragment>
#include <map_particle_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <fog_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main() {
	vec4 diffuseColor = vec4( diffuse, opacity );
	#include <clipping_planes_fragment>
	vec3 outgoingLight = vec3( 0.0 );
	#include <logdepthbuf_fragment>
	#include <map_particle_fragment>
	#include <color_fragment>
	#include <alphatest_fragment>
	#include <alphahash_fragment>
	outgoingLight = diffuseColor.rgb;
	#include <opaque_fragment>
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
	#include <fog_fragment>
	#include <premultiplied_alpha_fragment>
}`,_b=`#include <common>
#include <batching_pars_vertex>
#include <fog_pars_vertex>
#include <morphtarget_pars_vertex>
#include <skinning_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <shadowmap_pars_vertex>
void main() {
	#include <batching_vertex>
	#include <beginnormal_vertex>
	#include <morphinstance_vertex>
	#include <morphnormal_vertex>
	#include <skinbase_vertex>
	#include <skinnormal_vertex>
	#include <defaultnormal_vertex>
	#include <begin_vertex>
	#include <morphtarget_vertex>
	#include <skinning_vertex>
	#include <project_vertex>
	#include <logdepthbuf_vertex>
	#include <worldpos_vertex>
	#include <shadowmap_vertex>
	#include <fog_vertex>
}`,xb=`uniform vec3 color;
uniform float opacity;
#include <common>
#include <fog_pars_fragment>
#include <bsdfs>
#include <lights_pars_begin>
#include <logdepthbuf_pars_fragment>
#include <shadowmap_pars_fragment>
#include <shadowmask_pars_fragment>
void main() {
	#include <logdepthbuf_fragment>
	gl_FragColor = vec4( color, opacity * ( 1.0 - getShadowMask() ) );
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
	#include <fog_fragment>
	#include <premultiplied_alpha_fragment>
}`,bb=`uniform float rotation;
uniform vec2 center;
#include <common>
#include <uv_pars_vertex>
#include <fog_pars_vertex>
#include <logdepthbuf_pars_vertex>
#include <clipping_planes_pars_vertex>
void main() {
	#include <uv_vertex>
	vec4 mvPosition = modelViewMatrix[ 3 ];
	vec2 scale = vec2( length( modelMatrix[ 0 ].xyz ), length( modelMatrix[ 1 ].xyz ) );
	#ifndef USE_SIZEATTENUATION
		bool isPerspective = isPerspectiveMatrix( projectionMatrix );
		if ( isPerspective ) scale *= - mvPosition.z;
	#endif
	vec2 alignedPosition = ( position.xy - ( center - vec2( 0.5 ) ) ) * scale;
	vec2 rotatedPosition;
	rotatedPosition.x = cos( rotation ) * alignedPosition.x - sin( rotation ) * alignedPosition.y;
	rotatedPosition.y = sin( rotation ) * alignedPosition.x + cos( rotation ) * alignedPosition.y;
	mvPosition.xy += rotatedPosition;
	gl_Position = projectionMatrix * mvPosition;
	#include <logdepthbuf_vertex>
	#include <clipping_planes_vertex>
	#include <fog_vertex>
}`,wb=`uniform vec3 diffuse;
uniform float opacity;
#include <common>
#include <uv_pars_fragment>
#include <map_pars_fragment>
#include <alphamap_pars_fragment>
#include <alphatest_pars_fragment>
#include <alphahash_pars_fragment>
#include <fog_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>
void main() {
	vec4 diffuseColor = vec4( diffuse, opacity );
	#include <clipping_planes_fragment>
	vec3 outgoingLight = vec3( 0.0 );
	#include <logdepthbuf_fragment>
	#include <map_fragment>
	#include <alphamap_fragment>
	#include <alphatest_fragment>
	#include <alphahash_fragment>
	outgoingLight = diffuseColor.rgb;
	#include <opaque_fragment>
	#include <tonemapping_fragment>
	#include <colorspace_fragment>
	#include <fog_fragment>
}`,zt={alphahash_fragment:Gv,alphahash_pars_fragment:Wv,alphamap_fragment:Xv,alphamap_pars_fragment:qv,alphatest_fragment:$v,alphatest_pars_fragment:Yv,aomap_fragment:Kv,aomap_pars_fragment:Zv,batching_pars_vertex:jv,batching_vertex:Qv,begin_vertex:Jv,beginnormal_vertex:t_,bsdfs:e_,iridescence_fragment:n_,bumpmap_pars_fragment:i_,clipping_planes_fragment:s_,clipping_planes_pars_fragment:r_,clipping_planes_pars_vertex:o_,clipping_planes_vertex:a_,color_fragment:l_,color_pars_fragment:c_,color_pars_vertex:h_,color_vertex:u_,common:d_,defaultnormal_vertex:p_,displacementmap_pars_vertex:f_,displacementmap_vertex:m_,emissivemap_fragment:g_,emissivemap_pars_fragment:v_,colorspace_fragment:__,colorspace_pars_fragment:x_,envmap_fragment:b_,envmap_common_pars_fragment:w_,envmap_pars_fragment:y_,envmap_pars_vertex:S_,envmap_physical_pars_fragment:N_,envmap_vertex:E_,fog_vertex:M_,fog_pars_vertex:T_,fog_fragment:A_,fog_pars_fragment:C_,gradientmap_pars_fragment:R_,lightmap_pars_fragment:P_,lights_lambert_fragment:L_,lights_lambert_pars_fragment:D_,lights_pars_begin:I_,lights_toon_fragment:U_,lights_toon_pars_fragment:O_,lights_phong_fragment:F_,lights_phong_pars_fragment:k_,lights_physical_fragment:B_,lights_physical_pars_fragment:z_,lights_fragment_begin:V_,lights_fragment_maps:H_,lights_fragment_end:G_,lightprobes_pars_fragment:W_,logdepthbuf_fragment:X_,logdepthbuf_pars_fragment:q_,logdepthbuf_pars_vertex:$_,logdepthbuf_vertex:Y_,map_fragment:K_,map_pars_fragment:Z_,map_particle_fragment:j_,map_particle_pars_fragment:Q_,metalnessmap_fragment:J_,metalnessmap_pars_fragment:tx,morphinstance_vertex:ex,morphcolor_vertex:nx,morphnormal_vertex:ix,morphtarget_pars_vertex:sx,morphtarget_vertex:rx,normal_fragment_begin:ox,normal_fragment_maps:ax,normal_pars_fragment:lx,normal_pars_vertex:cx,normal_vertex:hx,normalmap_pars_fragment:ux,clearcoat_normal_fragment_begin:dx,clearcoat_normal_fragment_maps:px,clearcoat_pars_fragment:fx,iridescence_pars_fragment:mx,opaque_fragment:gx,packing:vx,premultiplied_alpha_fragment:_x,project_vertex:xx,dithering_fragment:bx,dithering_pars_fragment:wx,roughnessmap_fragment:yx,roughnessmap_pars_fragment:Sx,shadowmap_pars_fragment:Ex,shadowmap_pars_vertex:Mx,shadowmap_vertex:Tx,shadowmask_pars_fragment:Ax,skinbase_vertex:Cx,skinning_pars_vertex:Rx,skinning_vertex:Px,skinnormal_vertex:Lx,specularmap_fragment:Dx,specularmap_pars_fragment:Ix,tonemapping_fragment:Nx,tonemapping_pars_fragment:Ux,transmission_fragment:Ox,transmission_pars_fragment:Fx,uv_pars_fragment:kx,uv_pars_vertex:Bx,uv_vertex:zx,worldpos_vertex:Vx,background_vert:Hx,background_frag:Gx,backgroundCube_vert:Wx,backgroundCube_frag:Xx,cube_vert:qx,cube_frag:$x,depth_vert:Yx,depth_frag:Kx,distance_vert:Zx,distance_frag:jx,equirect_vert:Qx,equirect_frag:Jx,linedashed_vert:tb,linedashed_frag:eb,meshbasic_vert:nb,meshbasic_frag:ib,meshlambert_vert:sb,meshlambert_frag:rb,meshmatcap_vert:ob,meshmatcap_frag:ab,meshnormal_vert:lb,meshnormal_frag:cb,meshphong_vert:hb,meshphong_frag:ub,meshphysical_vert:db,meshphysical_frag:pb,meshtoon_vert:fb,meshtoon_frag:mb,points_vert:gb,points_frag:vb,shadow_vert:_b,shadow_frag:xb,sprite_vert:bb,sprite_frag:wb},ft={common:{diffuse:{value:new Zt(16777215)},opacity:{value:1},map:{value:null},mapTransform:{value:new Lt},alphaMap:{value:null},alphaMapTransform:{value:new Lt},alphaTest:{value:0}},specularmap:{specularMap:{value:null},specularMapTransform:{value:new Lt}},envmap:{envMap:{value:null},envMapRotation:{value:new Lt},reflectivity:{value:1},ior:{value:1.5},refractionRatio:{value:.98},dfgLUT:{value:null}},aomap:{aoMap:{value:null},aoMapIntensity:{value:1},aoMapTransform:{value:new Lt}},lightmap:{lightMap:{value:null},lightMapIntensity:{value:1},lightMapTransform:{value:new Lt}},bumpmap:{bumpMap:{value:null},bumpMapTransform:{value:new Lt},bumpScale:{value:1}},normalmap:{normalMap:{value:null},normalMapTransform:{value:new Lt},normalScale:{value:new It(1,1)}},displacementmap:{displacementMap:{value:null},displacementMapTransform:{value:new Lt},displacementScale:{value:1},displacementBias:{value:0}},emissivemap:{emissiveMap:{value:null},emissiveMapTransform:{value:new Lt}},metalnessmap:{metalnessMap:{value:null},metalnessMapTransform:{value:new Lt}},roughnessmap:{roughnessMap:{value:null},roughnessMapTransform:{value:new Lt}},gradientmap:{gradientMap:{value:null}},fog:{fogDensity:{value:25e-5},fogNear:{value:1},fogFar:{value:2e3},fogColor:{value:new Zt(16777215)}},lights:{ambientLightColor:{value:[]},lightProbe:{value:[]},sunLights:{value:[],properties:{direction:{},color:{}}},sunLightShadows:{value:[],properties:{shadowIntensity:1,shadowBias:{},shadowNormalBias:{},shadowRadius:{},shadowMapSize:{}}},sunShadowMatrix:{value:[]},sunShadowCascade:{value:[]},directionalLights:{value:[],properties:{direction:{},color:{}}},directionalLightShadows:{value:[],properties:{shadowIntensity:1,shadowBias:{},shadowNormalBias:{},shadowRadius:{},shadowMapSize:{}}},directionalShadowMatrix:{value:[]},spotLights:{value:[],properties:{color:{},position:{},direction:{},distance:{},coneCos:{},penumbraCos:{},decay:{}}},spotLightShadows:{value:[],properties:{shadowIntensity:1,shadowBias:{},shadowNormalBias:{},shadowRadius:{},shadowMapSize:{}}},spotLightMap:{value:[]},spotLightMatrix:{value:[]},pointLights:{value:[],properties:{color:{},position:{},decay:{},distance:{}}},pointLightShadows:{value:[],properties:{shadowIntensity:1,shadowBias:{},shadowNormalBias:{},shadowRadius:{},shadowMapSize:{},shadowCameraNear:{},shadowCameraFar:{}}},pointShadowMatrix:{value:[]},hemisphereLights:{value:[],properties:{direction:{},skyColor:{},groundColor:{}}},rectAreaLights:{value:[],properties:{color:{},position:{},width:{},height:{}}},ltc_1:{value:null},ltc_2:{value:null},probesSH:{value:[]},probesMin:{value:[]},probesMax:{value:[]},probesResolution:{value:[]}},points:{diffuse:{value:new Zt(16777215)},opacity:{value:1},size:{value:1},scale:{value:1},map:{value:null},alphaMap:{value:null},alphaMapTransform:{value:new Lt},alphaTest:{value:0},uvTransform:{value:new Lt}},sprite:{diffuse:{value:new Zt(16777215)},opacity:{value:1},center:{value:new It(.5,.5)},rotation:{value:0},map:{value:null},mapTransform:{value:new Lt},alphaMap:{value:null},alphaMapTransform:{value:new Lt},alphaTest:{value:0}}},Hn={basic:{uniforms:Je([ft.common,ft.specularmap,ft.envmap,ft.aomap,ft.lightmap,ft.fog]),vertexShader:zt.meshbasic_vert,fragmentShader:zt.meshbasic_frag},lambert:{uniforms:Je([ft.common,ft.specularmap,ft.envmap,ft.aomap,ft.lightmap,ft.emissivemap,ft.bumpmap,ft.normalmap,ft.displacementmap,ft.fog,ft.lights,{emissive:{value:new Zt(0)},envMapIntensity:{value:1}}]),vertexShader:zt.meshlambert_vert,fragmentShader:zt.meshlambert_frag},phong:{uniforms:Je([ft.common,ft.specularmap,ft.envmap,ft.aomap,ft.lightmap,ft.emissivemap,ft.bumpmap,ft.normalmap,ft.displacementmap,ft.fog,ft.lights,{emissive:{value:new Zt(0)},specular:{value:new Zt(1118481)},shininess:{value:30},envMapIntensity:{value:1}}]),vertexShader:zt.meshphong_vert,fragmentShader:zt.meshphong_frag},standard:{uniforms:Je([ft.common,ft.envmap,ft.aomap,ft.lightmap,ft.emissivemap,ft.bumpmap,ft.normalmap,ft.displacementmap,ft.roughnessmap,ft.metalnessmap,ft.fog,ft.lights,{emissive:{value:new Zt(0)},roughness:{value:1},metalness:{value:0},envMapIntensity:{value:1}}]),vertexShader:zt.meshphysical_vert,fragmentShader:zt.meshphysical_frag},toon:{uniforms:Je([ft.common,ft.aomap,ft.lightmap,ft.emissivemap,ft.bumpmap,ft.normalmap,ft.displacementmap,ft.gradientmap,ft.fog,ft.lights,{emissive:{value:new Zt(0)}}]),vertexShader:zt.meshtoon_vert,fragmentShader:zt.meshtoon_frag},matcap:{uniforms:Je([ft.common,ft.bumpmap,ft.normalmap,ft.displacementmap,ft.fog,{matcap:{value:null}}]),vertexShader:zt.meshmatcap_vert,fragmentShader:zt.meshmatcap_frag},points:{uniforms:Je([ft.points,ft.fog]),vertexShader:zt.points_vert,fragmentShader:zt.points_frag},dashed:{uniforms:Je([ft.common,ft.fog,{scale:{value:1},dashSize:{value:1},totalSize:{value:2}}]),vertexShader:zt.linedashed_vert,fragmentShader:zt.linedashed_frag},depth:{uniforms:Je([ft.common,ft.displacementmap]),vertexShader:zt.depth_vert,fragmentShader:zt.depth_frag},normal:{uniforms:Je([ft.common,ft.bumpmap,ft.normalmap,ft.displacementmap,{opacity:{value:1}}]),vertexShader:zt.meshnormal_vert,fragmentShader:zt.meshnormal_frag},sprite:{uniforms:Je([ft.sprite,ft.fog]),vertexShader:zt.sprite_vert,fragmentShader:zt.sprite_frag},background:{uniforms:{uvTransform:{value:new Lt},t2D:{value:null},backgroundIntensity:{value:1}},vertexShader:zt.background_vert,fragmentShader:zt.background_frag},backgroundCube:{uniforms:{envMap:{value:null},backgroundBlurriness:{value:0},backgroundIntensity:{value:1},backgroundRotation:{value:new Lt}},vertexShader:zt.backgroundCube_vert,fragmentShader:zt.backgroundCube_frag},cube:{uniforms:{tCube:{value:null},tFlip:{value:-1},opacity:{value:1}},vertexShader:zt.cube_vert,fragmentShader:zt.cube_frag},equirect:{uniforms:{tEquirect:{value:null}},vertexShader:zt.equirect_vert,fragmentShader:zt.equirect_frag},distance:{uniforms:Je([ft.common,ft.displacementmap,{referencePosition:{value:new C},nearDistance:{value:1},farDistance:{value:1e3}}]),vertexShader:zt.distance_vert,fragmentShader:zt.distance_frag},shadow:{uniforms:Je([ft.lights,ft.fog,{color:{value:new Zt(0)},opacity:{value:1}}]),vertexShader:zt.shadow_vert,fragmentShader:zt.shadow_frag}};Hn.physical={uniforms:Je([Hn.standard.uniforms,{clearcoat:{value:0},clearcoatMap:{value:null},clearcoatMapTransform:{value:new Lt},clearcoatNormalMap:{value:null},clearcoatNormalMapTransform:{value:new Lt},clearcoatNormalScale:{value:new It(1,1)},clearcoatRoughness:{value:0},clearcoatRoughnessMap:{value:null},clearcoatRoughnessMapTransform:{value:new Lt},diffuseRoughness:{value:0},diffuseRoughnessMap:{value:null},diffuseRoughnessMapTransform:{value:new Lt},dispersion:{value:0},retroreflectivity:{value:0},iridescence:{value:0},iridescenceMap:{value:null},iridescenceMapTransform:{value:new Lt},iridescenceIOR:{value:1.3},iridescenceThicknessMinimum:{value:100},iridescenceThicknessMaximum:{value:400},iridescenceThicknessMap:{value:null},iridescenceThicknessMapTransform:{value:new Lt},sheen:{value:0},sheenColor:{value:new Zt(0)},sheenColorMap:{value:null},sheenColorMapTransform:{value:new Lt},sheenRoughness:{value:1},sheenRoughnessMap:{value:null},sheenRoughnessMapTransform:{value:new Lt},transmission:{value:0},transmissionMap:{value:null},transmissionMapTransform:{value:new Lt},transmissionSamplerSize:{value:new It},transmissionSamplerMap:{value:null},thickness:{value:0},thicknessMap:{value:null},thicknessMapTransform:{value:new Lt},attenuationDistance:{value:0},attenuationColor:{value:new Zt(0)},specularColor:{value:new Zt(1,1,1)},specularColorMap:{value:null},specularColorMapTransform:{value:new Lt},specularIntensity:{value:1},specularIntensityMap:{value:null},specularIntensityMapTransform:{value:new Lt},anisotropyVector:{value:new It},anisotropyMap:{value:null},anisotropyMapTransform:{value:new Lt}}]),vertexShader:zt.meshphysical_vert,fragmentShader:zt.meshphysical_frag};const Uo={r:0,b:0,g:0},yb=new Yt,Lf=new Lt;Lf.set(-1,0,0,0,1,0,0,0,1);function Sb(n,t,e,i,s,r){const o=new Zt(0);let a=s===!0?0:1,l,c,h=null,d=0,u=null;function p(_){let M=_.isScene===!0?_.background:null;if(M&&M.isTexture){const b=_.backgroundBlurriness>0;M=t.get(M,b)}return M}function g(_){let M=!1;const b=p(_);b===null?m(o,a):b&&b.isColor&&(m(b,1),M=!0);const E=n.xr.getEnvironmentBlendMode();E==="additive"?e.buffers.color.setClear(0,0,0,1,r):E==="alpha-blend"&&e.buffers.color.setClear(0,0,0,0,r),(n.autoClear||M)&&(e.buffers.depth.setTest(!0),e.buffers.depth.setMask(!0),e.buffers.color.setMask(!0),n.clear(n.autoClearColor,n.autoClearDepth,n.autoClearStencil))}function x(_,M){const b=p(M);b&&b.isCubeTexture?(c===void 0&&(c=new _t(new Ce(1,1,1),new dn({name:"BackgroundCubeMaterial",uniforms:qs(Hn.backgroundCube.uniforms),vertexShader:Hn.backgroundCube.vertexShader,fragmentShader:Hn.backgroundCube.fragmentShader,side:an,depthTest:!1,depthWrite:!1,fog:!1,allowOverride:!1})),c.geometry.deleteAttribute("normal"),c.geometry.deleteAttribute("uv"),c.onBeforeRender=function(E,T,v){this.matrixWorld.copyPosition(v.matrixWorld)},Object.defineProperty(c.material,"envMap",{get:function(){return this.uniforms.envMap.value}}),i.update(c)),c.material.uniforms.envMap.value=b,c.material.uniforms.backgroundBlurriness.value=M.backgroundBlurriness,c.material.uniforms.backgroundIntensity.value=M.backgroundIntensity,c.material.uniforms.backgroundRotation.value.setFromMatrix4(yb.makeRotationFromEuler(M.backgroundRotation)).transpose(),b.isRenderTargetTexture===!1&&c.material.uniforms.backgroundRotation.value.premultiply(Lf),c.material.toneMapped=qt.getTransfer(b.colorSpace)!==re,(h!==b||d!==b.version||u!==n.toneMapping)&&(c.material.needsUpdate=!0,h=b,d=b.version,u=n.toneMapping),c.layers.enableAll(),_.unshift(c,c.geometry,c.material,0,0,null)):b&&b.isTexture&&(l===void 0&&(l=new _t(new Vi(2,2),new dn({name:"BackgroundMaterial",uniforms:qs(Hn.background.uniforms),vertexShader:Hn.background.vertexShader,fragmentShader:Hn.background.fragmentShader,side:ns,depthTest:!1,depthWrite:!1,fog:!1,allowOverride:!1})),l.geometry.deleteAttribute("normal"),Object.defineProperty(l.material,"map",{get:function(){return this.uniforms.t2D.value}}),i.update(l)),l.material.uniforms.t2D.value=b,l.material.uniforms.backgroundIntensity.value=M.backgroundIntensity,l.material.toneMapped=qt.getTransfer(b.colorSpace)!==re,b.matrixAutoUpdate===!0&&b.updateMatrix(),l.material.uniforms.uvTransform.value.copy(b.matrix),(h!==b||d!==b.version||u!==n.toneMapping)&&(l.material.needsUpdate=!0,h=b,d=b.version,u=n.toneMapping),l.layers.enableAll(),_.unshift(l,l.geometry,l.material,0,0,null))}function m(_,M){_.getRGB(Uo,Mf(n)),e.buffers.color.setClear(Uo.r,Uo.g,Uo.b,M,r)}function f(){c!==void 0&&(c.geometry.dispose(),c.material.dispose(),c=void 0),l!==void 0&&(l.geometry.dispose(),l.material.dispose(),l=void 0)}return{getClearColor:function(){return o},setClearColor:function(_,M=1){o.set(_),a=M,m(o,a)},getClearAlpha:function(){return a},setClearAlpha:function(_){a=_,m(o,a)},render:g,addToRenderList:x,dispose:f}}function Eb(n,t){const e=n.getParameter(n.MAX_VERTEX_ATTRIBS),i={},s=u(null);let r=s,o=!1;function a(U,D,F,L,z){let $=!1;const k=d(U,L,F,D);r!==k&&(r=k,c(r.object)),$=p(U,L,F,z),$&&g(U,L,F,z),z!==null&&t.update(z,n.ELEMENT_ARRAY_BUFFER),($||o)&&(o=!1,b(U,D,F,L),z!==null&&n.bindBuffer(n.ELEMENT_ARRAY_BUFFER,t.get(z).buffer))}function l(){return n.createVertexArray()}function c(U){return n.bindVertexArray(U)}function h(U){return n.deleteVertexArray(U)}function d(U,D,F,L){const z=L.wireframe===!0;let $=i[D.id];$===void 0&&($={},i[D.id]=$);const k=U.isInstancedMesh===!0?U.id:0;let tt=$[k];tt===void 0&&(tt={},$[k]=tt);let W=tt[F.id];W===void 0&&(W={},tt[F.id]=W);let Q=W[z];return Q===void 0&&(Q=u(l()),W[z]=Q),Q}function u(U){const D=[],F=[],L=[];for(let z=0;z<e;z++)D[z]=0,F[z]=0,L[z]=0;return{geometry:null,program:null,wireframe:!1,newAttributes:D,enabledAttributes:F,attributeDivisors:L,object:U,attributes:{},index:null}}function p(U,D,F,L){const z=r.attributes,$=D.attributes;let k=0;const tt=F.getAttributes();for(const W in tt)if(tt[W].location>=0){const et=z[W];let xt=$[W];if(xt===void 0&&(W==="instanceMatrix"&&U.instanceMatrix&&(xt=U.instanceMatrix),W==="instanceColor"&&U.instanceColor&&(xt=U.instanceColor)),et===void 0||et.attribute!==xt||xt&&et.data!==xt.data)return!0;k++}return r.attributesNum!==k||r.index!==L}function g(U,D,F,L){const z={},$=D.attributes;let k=0;const tt=F.getAttributes();for(const W in tt)if(tt[W].location>=0){let et=$[W];et===void 0&&(W==="instanceMatrix"&&U.instanceMatrix&&(et=U.instanceMatrix),W==="instanceColor"&&U.instanceColor&&(et=U.instanceColor));const xt={};xt.attribute=et,et&&et.data&&(xt.data=et.data),z[W]=xt,k++}r.attributes=z,r.attributesNum=k,r.index=L}function x(){const U=r.newAttributes;for(let D=0,F=U.length;D<F;D++)U[D]=0}function m(U){f(U,0)}function f(U,D){const F=r.newAttributes,L=r.enabledAttributes,z=r.attributeDivisors;F[U]=1,L[U]===0&&(n.enableVertexAttribArray(U),L[U]=1),z[U]!==D&&(n.vertexAttribDivisor(U,D),z[U]=D)}function _(){const U=r.newAttributes,D=r.enabledAttributes;for(let F=0,L=D.length;F<L;F++)D[F]!==U[F]&&(n.disableVertexAttribArray(F),D[F]=0)}function M(U,D,F,L,z,$,k){k===!0?n.vertexAttribIPointer(U,D,F,z,$):n.vertexAttribPointer(U,D,F,L,z,$)}function b(U,D,F,L){x();const z=L.attributes,$=F.getAttributes(),k=D.defaultAttributeValues;for(const tt in $){const W=$[tt];if(W.location>=0){let Q=z[tt];if(Q===void 0&&(tt==="instanceMatrix"&&U.instanceMatrix&&(Q=U.instanceMatrix),tt==="instanceColor"&&U.instanceColor&&(Q=U.instanceColor)),Q!==void 0){const et=Q.normalized,xt=Q.itemSize,Nt=t.get(Q);if(Nt===void 0)continue;const K=Nt.buffer,mt=Nt.type,wt=Nt.bytesPerElement,Ct=mt===n.INT||mt===n.UNSIGNED_INT||Q.gpuType===Xc;if(Q.isInterleavedBufferAttribute){const gt=Q.data,Ft=gt.isInterleavedBuffer===!0?gt.stride:gt.itemSize,Me=Q.offset;if(gt.isInstancedInterleavedBuffer||gt.isInstancedBufferAttribute){for(let Pt=0;Pt<W.locationSize;Pt++)f(W.location+Pt,gt.meshPerAttribute);U.isInstancedMesh!==!0&&L._maxInstanceCount===void 0&&(L._maxInstanceCount=gt.meshPerAttribute*gt.count)}else for(let Pt=0;Pt<W.locationSize;Pt++)m(W.location+Pt);n.bindBuffer(n.ARRAY_BUFFER,K);for(let Pt=0;Pt<W.locationSize;Pt++)M(W.location+Pt,xt/W.locationSize,mt,et,Ft*wt,(Me+xt/W.locationSize*Pt)*wt,Ct)}else{if(Q.isInstancedBufferAttribute){for(let gt=0;gt<W.locationSize;gt++)f(W.location+gt,Q.meshPerAttribute);U.isInstancedMesh!==!0&&L._maxInstanceCount===void 0&&(L._maxInstanceCount=Q.meshPerAttribute*Q.count)}else for(let gt=0;gt<W.locationSize;gt++)m(W.location+gt);n.bindBuffer(n.ARRAY_BUFFER,K);for(let gt=0;gt<W.locationSize;gt++)M(W.location+gt,xt/W.locationSize,mt,et,xt*wt,xt/W.locationSize*gt*wt,Ct)}}else if(k!==void 0){const et=k[tt];if(et!==void 0)switch(et.length){case 2:n.vertexAttrib2fv(W.location,et);break;case 3:n.vertexAttrib3fv(W.location,et);break;case 4:n.vertexAttrib4fv(W.location,et);break;default:n.vertexAttrib1fv(W.location,et)}}}}_()}function E(){N();for(const U in i){const D=i[U];for(const F in D){const L=D[F];for(const z in L){const $=L[z];for(const k in $)h($[k].object),delete $[k];delete L[z]}}delete i[U]}}function T(U){if(i[U.id]===void 0)return;const D=i[U.id];for(const F in D){const L=D[F];for(const z in L){const $=L[z];for(const k in $)h($[k].object),delete $[k];delete L[z]}}delete i[U.id]}function v(U){for(const D in i){const F=i[D];for(const L in F){const z=F[L];if(z[U.id]===void 0)continue;const $=z[U.id];for(const k in $)h($[k].object),delete $[k];delete z[U.id]}}}function S(U){for(const D in i){const F=i[D],L=U.isInstancedMesh===!0?U.id:0,z=F[L];if(z!==void 0){for(const $ in z){const k=z[$];for(const tt in k)h(k[tt].object),delete k[tt];delete z[$]}delete F[L],Object.keys(F).length===0&&delete i[D]}}}function N(){P(),o=!0,r!==s&&(r=s,c(r.object))}function P(){s.geometry=null,s.program=null,s.wireframe=!1}return{setup:a,reset:N,resetDefaultState:P,dispose:E,releaseStatesOfGeometry:T,releaseStatesOfObject:S,releaseStatesOfProgram:v,initAttributes:x,enableAttribute:m,disableUnusedAttributes:_}}function Mb(n,t,e){let i;function s(l){i=l}function r(l,c){n.drawArrays(i,l,c),e.update(c,i,1)}function o(l,c,h){h!==0&&(n.drawArraysInstanced(i,l,c,h),e.update(c,i,h))}function a(l,c,h){if(h===0)return;t.get("WEBGL_multi_draw").multiDrawArraysWEBGL(i,l,0,c,0,h);let u=0;for(let p=0;p<h;p++)u+=c[p];e.update(u,i,1)}this.setMode=s,this.render=r,this.renderInstances=o,this.renderMultiDraw=a}function Tb(n,t,e,i){let s;function r(){if(s!==void 0)return s;if(t.has("EXT_texture_filter_anisotropic")===!0){const v=t.get("EXT_texture_filter_anisotropic");s=n.getParameter(v.MAX_TEXTURE_MAX_ANISOTROPY_EXT)}else s=0;return s}function o(v){return!(v!==Wn&&i.convert(v)!==n.getParameter(n.IMPLEMENTATION_COLOR_READ_FORMAT))}function a(v){const S=v===Yn&&(t.has("EXT_color_buffer_half_float")||t.has("EXT_color_buffer_float"));return!(v!==yn&&v!==Nn&&!S&&i.convert(v)!==n.getParameter(n.IMPLEMENTATION_COLOR_READ_TYPE))}function l(v){if(v==="highp"){if(n.getShaderPrecisionFormat(n.VERTEX_SHADER,n.HIGH_FLOAT).precision>0&&n.getShaderPrecisionFormat(n.FRAGMENT_SHADER,n.HIGH_FLOAT).precision>0)return"highp";v="mediump"}return v==="mediump"&&n.getShaderPrecisionFormat(n.VERTEX_SHADER,n.MEDIUM_FLOAT).precision>0&&n.getShaderPrecisionFormat(n.FRAGMENT_SHADER,n.MEDIUM_FLOAT).precision>0?"mediump":"lowp"}let c=e.precision!==void 0?e.precision:"highp";const h=l(c);h!==c&&(Dt("WebGLRenderer:",c,"not supported, using",h,"instead."),c=h);const d=e.reversedDepthBuffer===!0&&t.has("EXT_clip_control"),u=e.logarithmicDepthBuffer===!0&&d===!1;e.reversedDepthBuffer===!0&&d===!1&&Dt("WebGLRenderer: Unable to use reversed depth buffer due to missing EXT_clip_control extension. Fallback to default depth buffer."),e.logarithmicDepthBuffer===!0&&d===!0&&Dt("WebGLRenderer: Logarithmic depth buffer is ignored when reversed depth buffer is enabled.");const p=n.getParameter(n.MAX_TEXTURE_IMAGE_UNITS),g=n.getParameter(n.MAX_VERTEX_TEXTURE_IMAGE_UNITS),x=n.getParameter(n.MAX_TEXTURE_SIZE),m=n.getParameter(n.MAX_CUBE_MAP_TEXTURE_SIZE),f=n.getParameter(n.MAX_VERTEX_ATTRIBS),_=n.getParameter(n.MAX_VERTEX_UNIFORM_VECTORS),M=n.getParameter(n.MAX_VARYING_VECTORS),b=n.getParameter(n.MAX_FRAGMENT_UNIFORM_VECTORS),E=n.getParameter(n.MAX_SAMPLES),T=n.getParameter(n.SAMPLES);return{isWebGL2:!0,getMaxAnisotropy:r,getMaxPrecision:l,textureFormatReadable:o,textureTypeReadable:a,precision:c,logarithmicDepthBuffer:u,reversedDepthBuffer:d,maxTextures:p,maxVertexTextures:g,maxTextureSize:x,maxCubemapSize:m,maxAttributes:f,maxVertexUniforms:_,maxVaryings:M,maxFragmentUniforms:b,maxSamples:E,samples:T}}function Ab(n){const t=this;let e=null,i=0,s=!1,r=!1;const o=new Vn,a=new Lt,l={value:null,needsUpdate:!1};this.uniform=l,this.numPlanes=0,this.numIntersection=0,this.init=function(d,u){const p=d.length!==0||u||i!==0||s;return s=u,i=d.length,p},this.beginShadows=function(){r=!0,h(null)},this.endShadows=function(){r=!1},this.setGlobalState=function(d,u){e=h(d,u,0)},this.setState=function(d,u,p){const g=d.clippingPlanes,x=d.clipIntersection,m=d.clipShadows,f=n.get(d);if(!s||g===null||g.length===0||r&&!m)r?h(null):c();else{const _=r?0:i,M=_*4;let b=f.clippingState||null;l.value=b,b=h(g,u,M,p);for(let E=0;E!==M;++E)b[E]=e[E];f.clippingState=b,this.numIntersection=x?this.numPlanes:0,this.numPlanes+=_}};function c(){l.value!==e&&(l.value=e,l.needsUpdate=i>0),t.numPlanes=i,t.numIntersection=0}function h(d,u,p,g){const x=d!==null?d.length:0;let m=null;if(x!==0){if(m=l.value,g!==!0||m===null){const f=p+x*4,_=u.matrixWorldInverse;a.getNormalMatrix(_),(m===null||m.length<f)&&(m=new Float32Array(f));for(let M=0,b=p;M!==x;++M,b+=4)o.copy(d[M]).applyMatrix4(_,a),o.normal.toArray(m,b),m[b+3]=o.constant}l.value=m,l.needsUpdate=!0}return t.numPlanes=x,t.numIntersection=0,m}}class ah extends En{constructor(t=1,e={}){super(t,t,e),this.isWebGLCubeRenderTarget=!0;const i={width:t,height:t,depth:1},s=[i,i,i,i,i,i];this.texture=new yf(s),this._setTextureOptions(e),this.texture.isRenderTargetTexture=!0}fromEquirectangularTexture(t,e){this.texture.type=e.type,this.texture.colorSpace=e.colorSpace,this.texture.generateMipmaps=e.generateMipmaps,this.texture.minFilter=e.minFilter,this.texture.magFilter=e.magFilter;const i={uniforms:{tEquirect:{value:null}},vertexShader:`

				varying vec3 vWorldDirection;

				vec3 transformDirection( in vec3 dir, in mat4 matrix ) {

					return normalize( ( matrix * vec4( dir, 0.0 ) ).xyz );

				}

				void main() {

					vWorldDirection = transformDirection( position, modelMatrix );

					#include <begin_vertex>
					#include <project_vertex>

				}
			`,fragmentShader:`

				uniform sampler2D tEquirect;

				varying vec3 vWorldDirection;

				#include <common>

				void main() {

					vec3 direction = normalize( vWorldDirection );

					vec2 sampleUV = equirectUv( direction );

					gl_FragColor = texture2D( tEquirect, sampleUV );

				}
			`},s=new Ce(5,5,5),r=new dn({name:"CubemapFromEquirect",uniforms:qs(i.uniforms),vertexShader:i.vertexShader,fragmentShader:i.fragmentShader,side:an,blending:Ns});r.uniforms.tEquirect.value=e;const o=new _t(s,r),a=e.minFilter;return e.minFilter===Ni&&(e.minFilter=tn),new Mc(1,10,this).update(t,o),e.minFilter=a,o.geometry.dispose(),o.material.dispose(),this}clear(t,e=!0,i=!0,s=!0){const r=t.getRenderTarget();for(let o=0;o<6;o++)t.setRenderTarget(this,o),t.clear(e,i,s);t.setRenderTarget(r)}}const qu=256,Cb=3,Rb=20,Df=256,If=16,Pb=3,Lb=new C,Db=new Zt;class ma{constructor(t){this._renderer=t,this._cubeSize=0,this._sourceTarget=null,this._cubeCamera=new Mc(1,10,null),this._boxMesh=new _t(new Ce(5,5,5),null),this._cubemapMaterial=null,this._equirectMaterial=null,this._blurMaterial=null,this._ggxMaterial=null,this._integrationMaterial=null}fromScene(t,e=0,i=.1,s=100,r={}){const{size:o=256,position:a=Lb}=r,l=this._renderer;this._setSize(o);const c=this._allocateTarget(),h=this._getSourceTarget(!0);e>0&&(h.texture.mipmapsAutoUpdate=!1);const d=l.autoClear,u=l.autoClearColor,p=l.autoClearDepth,g=l.autoClearStencil,x=t.background;l.autoClear=!0,l.autoClearColor=!0,l.autoClearDepth=!0,l.autoClearStencil=!0,x===null&&(t.background=l.getClearColor(Db));const m=new Mc(i,s,h);return m.position.copy(a),m.update(l,t),l.autoClear=d,l.autoClearColor=u,l.autoClearDepth=p,l.autoClearStencil=g,t.background=x,e>0&&(h.texture.mipmapsAutoUpdate=!0,this._blur(c,e)),this._applyPMREM(c),c}fromEquirectangular(t,e=null){return this._fromTexture(t,e)}fromCubemap(t,e=null){return this._fromTexture(t,e)}compileCubemapShader(){this._cubemapMaterial===null&&(this._cubemapMaterial=Ku(),this._compileMaterial(this._cubemapMaterial))}compileEquirectangularShader(){this._equirectMaterial===null&&(this._equirectMaterial=Yu(),this._compileMaterial(this._equirectMaterial))}dispose(){this._sourceTarget!==null&&this._sourceTarget.dispose(),this._cubemapMaterial!==null&&this._cubemapMaterial.dispose(),this._equirectMaterial!==null&&this._equirectMaterial.dispose(),this._blurMaterial!==null&&this._blurMaterial.dispose(),this._ggxMaterial!==null&&this._ggxMaterial.dispose(),this._integrationMaterial!==null&&this._integrationMaterial.dispose(),this._boxMesh.geometry.dispose()}static lodToRoughness(t,e){return e>0?1-Math.sqrt(1-t/e):0}_setSize(t){this._cubeSize=Math.max(qu,df(t))}_fromTexture(t,e){t.mapping===Gs||t.mapping===Lr?this._setSize(t.image.length===0?qu:t.image[0].width||t.image[0].image.width):this._setSize(t.image.width/4);const i=e||this._allocateTarget();return this._textureToCubemap(t),this._applyPMREM(i),i}_allocateTarget(){const t=this._cubeSize,e=$u(t,!1,!1),i=Math.log2(t)-Cb;for(let s=0;s<=i;s++)e.texture.mipmaps.push({width:t>>s,height:t>>s});return e.texture.name="PMREM",e.texture.isPMREMTexture=!0,e}_getSourceTarget(t=!1){const e=this._cubeSize,i=this._sourceTarget;return(i===null||i.width!==e||t&&i.depthBuffer===!1)&&(i!==null&&i.dispose(),this._sourceTarget=$u(e,!0,t)),this._sourceTarget}_compileMaterial(t){this._boxMesh.material=t,this._renderer.compile(this._boxMesh,this._cubeCamera.children[0])}_renderCube(t,e,i){const s=this._boxMesh,r=this._cubeCamera;s.material=i,r.renderTarget=t,r.activeMipmapLevel=e;const o=t.width>>e;t.viewport.set(0,0,o,o),r.update(this._renderer,s),t.viewport.set(0,0,t.width,t.height)}_textureToCubemap(t){let e;t.mapping===Gs||t.mapping===Lr?(this._cubemapMaterial===null&&(this._cubemapMaterial=Ku()),e=this._cubemapMaterial,e.uniforms.flipEnvMap.value=t.isRenderTargetTexture===!1?-1:1):(this._equirectMaterial===null&&(this._equirectMaterial=Yu()),e=this._equirectMaterial),e.uniforms.envMap.value=t,this._renderCube(this._getSourceTarget(),0,e)}_applyPMREM(t){this._ggxMaterial===null&&(this._ggxMaterial=Ib(),this._integrationMaterial=Nb());const e=this._cubeSize,i=t.texture.mipmaps.length-1,s=this._ggxMaterial.uniforms;s.envMap.value=this._sourceTarget.texture;const r=this._integrationMaterial.uniforms;r.envMap.value=this._sourceTarget.texture,r.sourceLod.value=Math.log2(e/If);for(let o=0;o<=i;o++){const a=ma.lodToRoughness(o,i);if(o>i-Pb)r.roughness.value=a,this._renderCube(t,o,this._integrationMaterial);else{const l=a>0?Math.log2(e)+.5*Math.log2(6/(Df*Math.pow(a,4)))+.5:0;s.roughness.value=a,s.lodBias.value=l,this._renderCube(t,o,this._ggxMaterial)}}}_blur(t,e){this._blurMaterial===null&&(this._blurMaterial=Ub());const i=this._blurMaterial,s=i.uniforms,r=this._sourceTarget;s.sigma.value=Math.min(e,Math.PI)/Math.SQRT2,s.envMap.value=r.texture,this._renderCube(t,0,i),s.envMap.value=t.texture,this._renderCube(r,0,i)}}function $u(n,t,e){return new ah(n,{minFilter:Ni,generateMipmaps:t,type:Yn,colorSpace:la,depthBuffer:e})}function $r(n,t,e){return new dn({name:n,uniforms:t,vertexShader:zt.cube_vert,fragmentShader:e,side:an,blending:Ns,depthTest:!1,depthWrite:!1})}function Ib(){return $r("PMREMGGXConvolution",{envMap:{value:null},roughness:{value:0},lodBias:{value:0}},`

		#define GGX_SAMPLES ${Df}u

		varying vec3 vWorldDirection;

		uniform samplerCube envMap;
		uniform float roughness;
		uniform float lodBias;

		#include <common>

		// Van der Corput radical inverse
		float radicalInverse_VdC( uint bits ) {

			bits = ( bits << 16u ) | ( bits >> 16u );
			bits = ( ( bits & 0x55555555u ) << 1u ) | ( ( bits & 0xAAAAAAAAu ) >> 1u );
			bits = ( ( bits & 0x33333333u ) << 2u ) | ( ( bits & 0xCCCCCCCCu ) >> 2u );
			bits = ( ( bits & 0x0F0F0F0Fu ) << 4u ) | ( ( bits & 0xF0F0F0F0u ) >> 4u );
			bits = ( ( bits & 0x00FF00FFu ) << 8u ) | ( ( bits & 0xFF00FF00u ) >> 8u );
			return float( bits ) * 2.3283064365386963e-10; // / 0x100000000

		}

		// Hammersley sequence
		vec2 hammersley( uint i, uint N ) {

			return vec2( float( i ) / float( N ), radicalInverse_VdC( i ) );

		}

		void main() {

			vec3 N = normalize( vWorldDirection );

			// For very low roughness, just sample the environment directly
			if ( roughness < 0.001 ) {

				gl_FragColor = vec4( textureLod( envMap, N, 0.0 ).rgb, 1.0 );
				return;

			}

			float alpha = roughness * roughness;
			float alpha2 = alpha * alpha;

			// Tangent space basis for VNDF sampling
			vec3 up = abs( N.z ) < 0.999 ? vec3( 0.0, 0.0, 1.0 ) : vec3( 1.0, 0.0, 0.0 );
			vec3 tangent = normalize( cross( up, N ) );
			vec3 bitangent = cross( N, tangent );

			vec3 prefilteredColor = vec3( 0.0 );
			float totalWeight = 0.0;

			for ( uint i = 0u; i < GGX_SAMPLES; i ++ ) {

				vec2 Xi = hammersley( i, GGX_SAMPLES );

				// With V = N, sample the reflected direction directly.
				float invQ = 1.0 / ( 1.0 - Xi.x + alpha2 * Xi.x );
				float NdotL = ( 1.0 - Xi.x - alpha2 * Xi.x ) * invQ;

				if ( NdotL > 0.0 ) {

					float phi = 2.0 * PI * Xi.y;
					float sinTheta = 2.0 * alpha * sqrt( Xi.x * ( 1.0 - Xi.x ) ) * invQ;
					vec3 L = N * NdotL + ( tangent * cos( phi ) + bitangent * sin( phi ) ) * sinTheta;

					// Match the source mip to the sample's solid angle. The terms
					// independent of the sample are precomputed in lodBias.
					float d = alpha2 * invQ;
					float lod = max( log2( d ) + lodBias, 0.0 );

					// Weight by NdotL for the split-sum approximation
					prefilteredColor += textureLod( envMap, L, lod ).rgb * NdotL;
					totalWeight += NdotL;

				}

			}

			gl_FragColor = vec4( prefilteredColor / totalWeight, 1.0 );

		}
	`)}function Nb(){return $r("PMREMGGXIntegration",{envMap:{value:null},roughness:{value:0},sourceLod:{value:0},sourceSize:{value:If}},`

		varying vec3 vWorldDirection;

		uniform samplerCube envMap;
		uniform float roughness;
		uniform float sourceLod;
		uniform int sourceSize;

		void main() {

			vec3 N = normalize( vWorldDirection );

			float alpha = roughness * roughness;
			float alpha2 = alpha * alpha;

			float texelSize = 2.0 / float( sourceSize );

			vec3 prefilteredColor = vec3( 0.0 );
			float totalWeight = 0.0;

			// Pair opposite texels: only the one in N's hemisphere contributes.
			for ( int face = 0; face < 3; face ++ ) {

				for ( int y = 0; y < sourceSize; y ++ ) {

					for ( int x = 0; x < sourceSize; x ++ ) {

						vec2 uv = ( vec2( x, y ) + 0.5 ) * texelSize - 1.0;
						vec3 texelDirection = face == 0 ? vec3( 1.0, uv ) : ( face == 1 ? vec3( uv.x, 1.0, uv.y ) : vec3( uv, 1.0 ) );

						float invDistance = inversesqrt( 1.0 + dot( uv, uv ) );
						float NdotL = dot( N, texelDirection );
						texelDirection *= NdotL < 0.0 ? - 1.0 : 1.0;
						NdotL = abs( NdotL ) * invDistance;

						// With V = N, NdotH squared is ( 1 + NdotL ) / 2. Common factors
						// in the GGX distribution and texel solid angle cancel when normalized.
						float d = 1.0 + alpha2 + ( alpha2 - 1.0 ) * NdotL;
						float weight = NdotL * invDistance * invDistance * invDistance / ( d * d );

						prefilteredColor += textureLod( envMap, texelDirection, sourceLod ).rgb * weight;
						totalWeight += weight;

					}

				}

			}

			gl_FragColor = vec4( prefilteredColor / totalWeight, 1.0 );

		}
	`)}function Ub(){return $r("PMREMSphericalGaussianBlur",{envMap:{value:null},sigma:{value:0}},`

		#define SAMPLES ${Rb}
		#define GOLDEN_ANGLE 2.39996322973

		varying vec3 vWorldDirection;

		uniform samplerCube envMap;
		uniform float sigma;

		#include <common>

		void main() {

			vec3 outputDirection = normalize( vWorldDirection );

			vec3 up = abs( outputDirection.z ) < 0.999 ? vec3( 0.0, 0.0, 1.0 ) : vec3( 1.0, 0.0, 0.0 );
			vec3 tangent = normalize( cross( up, outputDirection ) );
			vec3 bitangent = cross( outputDirection, tangent );

			// Truncate the kernel at three standard deviations or at the antipode.
			float thetaMax = min( 3.0 * sigma, PI );
			float truncation = 1.0 - exp( - 0.5 * thetaMax * thetaMax / ( sigma * sigma ) );

			vec3 accumColor = vec3( 0.0 );
			float accumWeight = 0.0;

			for ( int i = 0; i < SAMPLES; i ++ ) {

				// Stratified inverse-CDF sampling of the Gaussian, placed on a golden-angle spiral.
				float stratum = ( float( i ) + 0.5 ) / float( SAMPLES );
				float theta = sigma * sqrt( - 2.0 * log( 1.0 - stratum * truncation ) );
				float phi = float( i ) * GOLDEN_ANGLE;

				vec3 offset = cos( phi ) * tangent + sin( phi ) * bitangent;
				vec3 sampleDirection = cos( theta ) * outputDirection + sin( theta ) * offset;

				// Correct the planar sample density to solid angle.
				float weight = sin( theta ) / theta;

				accumColor += weight * textureLod( envMap, sampleDirection, 0.0 ).rgb;
				accumWeight += weight;

			}

			gl_FragColor = vec4( accumColor / accumWeight, 1.0 );

		}
	`)}function Yu(){return $r("PMREMEquirectangularToCubemap",{envMap:{value:null}},`

		varying vec3 vWorldDirection;

		uniform sampler2D envMap;

		#include <common>

		void main() {

			// Average four subpixel samples to preserve small, bright features.
			vec3 direction = normalize( vWorldDirection );
			vec3 dx = dFdx( direction ) * 0.25;
			vec3 dy = dFdy( direction ) * 0.25;

			vec3 color = textureLod( envMap, equirectUv( normalize( direction - dx - dy ) ), 0.0 ).rgb;
			color += textureLod( envMap, equirectUv( normalize( direction + dx - dy ) ), 0.0 ).rgb;
			color += textureLod( envMap, equirectUv( normalize( direction - dx + dy ) ), 0.0 ).rgb;
			color += textureLod( envMap, equirectUv( normalize( direction + dx + dy ) ), 0.0 ).rgb;
			gl_FragColor = vec4( color * 0.25, 1.0 );

		}
	`)}function Ku(){return $r("PMREMCubemapToCubemap",{envMap:{value:null},flipEnvMap:{value:-1}},`

		varying vec3 vWorldDirection;

		uniform samplerCube envMap;
		uniform float flipEnvMap;

		void main() {

			gl_FragColor = vec4( textureCube( envMap, vec3( flipEnvMap * vWorldDirection.x, vWorldDirection.yz ) ).rgb, 1.0 );

		}
	`)}function Ob(n){let t=new WeakMap,e=new WeakMap,i=null;function s(u,p=!1){return u==null?null:p?o(u):r(u)}function r(u){if(u&&u.isTexture){const p=u.mapping;if(p===Ga||p===Wa)if(t.has(u)){const g=t.get(u).texture;return a(g,u.mapping)}else{const g=u.image;if(g&&g.height>0){const x=new ah(g.height);return x.fromEquirectangularTexture(n,u),t.set(u,x),u.addEventListener("dispose",c),a(x.texture,u.mapping)}else return null}}return u}function o(u){if(u&&u.isTexture&&u.isPMREMTexture!==!0){const p=u.mapping,g=p===Ga||p===Wa,x=p===Gs||p===Lr;if(g||x){let m=e.get(u);const f=m!==void 0?m.texture.pmremVersion:0;if(u.isRenderTargetTexture&&u.pmremVersion!==f)return i===null&&(i=new ma(n)),m=g?i.fromEquirectangular(u,m):i.fromCubemap(u,m),m.texture.pmremVersion=u.pmremVersion,e.set(u,m),m.texture;if(m!==void 0)return m.texture;{const _=u.image;return g&&_&&_.height>0||x&&_&&l(_)?(i===null&&(i=new ma(n)),m=g?i.fromEquirectangular(u):i.fromCubemap(u),m.texture.pmremVersion=u.pmremVersion,e.set(u,m),u.addEventListener("dispose",h),m.texture):null}}}return u}function a(u,p){return p===Ga?u.mapping=Gs:p===Wa&&(u.mapping=Lr),u}function l(u){let p=0;const g=6;for(let x=0;x<g;x++)u[x]!==void 0&&p++;return p===g}function c(u){const p=u.target;p.removeEventListener("dispose",c);const g=t.get(p);g!==void 0&&(t.delete(p),g.dispose())}function h(u){const p=u.target;p.removeEventListener("dispose",h);const g=e.get(p);g!==void 0&&(e.delete(p),g.dispose())}function d(){t=new WeakMap,e=new WeakMap,i!==null&&(i.dispose(),i=null)}return{get:s,dispose:d}}function Fb(n){const t={};function e(i){if(t[i]!==void 0)return t[i];const s=n.getExtension(i);return t[i]=s,s}return{has:function(i){return e(i)!==null},init:function(){e("EXT_color_buffer_float"),e("WEBGL_clip_cull_distance"),e("OES_texture_float_linear"),e("EXT_color_buffer_half_float"),e("WEBGL_multisampled_render_to_texture"),e("WEBGL_render_shared_exponent")},get:function(i){const s=e(i);return s===null&&Qo("WebGLRenderer: "+i+" extension not supported."),s}}}function kb(n,t,e,i){const s={},r=new WeakMap,o=new FinalizationRegistry(g=>delete s[g]);function a(g){l(g.target)}function l(g){g.index!==null&&t.remove(g.index);for(const m in g.attributes)t.remove(g.attributes[m]);g.removeEventListener("dispose",a),delete s[g.id],o.unregister(g);const x=r.get(g);x&&(t.remove(x),r.delete(g)),i.releaseStatesOfGeometry(g),g.isInstancedBufferGeometry===!0&&delete g._maxInstanceCount,e.memory.geometries--}function c(g,x){return s[x.id]!==void 0||(x.addEventListener("dispose",a),s[x.id]=new WeakRef(x),o.register(x,x.id,x),e.memory.geometries++),x}function h(g){const x=g.attributes;for(const m in x)t.update(x[m],n.ARRAY_BUFFER)}function d(g){const x=g.index,m=g.attributes.position;let f=0;if(m===void 0)return;const _=x!==null?x.array.length:m.array.length/3-1,M=m.count>=65535?_f:vf,b=new M(Math.ceil(_/3)*6,1),E=b.array;if(x!==null){const v=x.array;f=x.version;for(let S=0,N=0;S<_;S+=3){const P=v[S+0],U=v[S+1],D=v[S+2];E[N++]=P,E[N++]=U,E[N++]=U,E[N++]=D,E[N++]=D,E[N++]=P}}else{f=m.version;for(let v=0,S=0;v<_;v+=3){const N=v+0,P=v+1,U=v+2;E[S++]=N,E[S++]=P,E[S++]=P,E[S++]=U,E[S++]=U,E[S++]=N}}b.version=f;const T=r.get(g);T&&t.remove(T),r.set(g,b)}function u(g){const x=r.get(g);if(x){const m=g.index;m!==null&&x.version<m.version&&d(g)}else d(g);return r.get(g)}function p(){for(const g in s){const x=s[g].deref();x!==void 0&&l(x)}}return{get:c,update:h,getWireframeAttribute:u,dispose:p}}function Bb(n,t,e){let i;function s(d){i=d}let r,o;function a(d){r=d.type,o=d.bytesPerElement}function l(d,u){n.drawElements(i,u,r,d*o),e.update(u,i,1)}function c(d,u,p){p!==0&&(n.drawElementsInstanced(i,u,r,d*o,p),e.update(u,i,p))}function h(d,u,p){if(p===0)return;t.get("WEBGL_multi_draw").multiDrawElementsWEBGL(i,u,0,r,d,0,p);let x=0;for(let m=0;m<p;m++)x+=u[m];e.update(x,i,1)}this.setMode=s,this.setIndex=a,this.render=l,this.renderInstances=c,this.renderMultiDraw=h}function zb(n){const t={geometries:0,textures:0},e={frame:0,calls:0,triangles:0,points:0,lines:0};function i(r,o,a){switch(e.calls++,o){case n.TRIANGLES:e.triangles+=a*(r/3);break;case n.LINES:e.lines+=a*(r/2);break;case n.LINE_STRIP:e.lines+=a*(r-1);break;case n.LINE_LOOP:e.lines+=a*r;break;case n.POINTS:e.points+=a*r;break;default:Qt("WebGLInfo: Unknown draw mode:",o);break}}function s(){e.calls=0,e.triangles=0,e.points=0,e.lines=0}return{memory:t,render:e,programs:null,autoReset:!0,reset:s,update:i}}function Vb(n,t,e){const i=new WeakMap,s=new Ee;function r(o,a,l){const c=o.morphTargetInfluences,h=a.morphAttributes.position||a.morphAttributes.normal||a.morphAttributes.color,d=h!==void 0?h.length:0;let u=i.get(a);if(u===void 0||u.count!==d){let P=function(){S.dispose(),i.delete(a),a.removeEventListener("dispose",P)};var p=P;u!==void 0&&u.texture.dispose();const g=a.morphAttributes.position!==void 0,x=a.morphAttributes.normal!==void 0,m=a.morphAttributes.color!==void 0,f=a.morphAttributes.position||[],_=a.morphAttributes.normal||[],M=a.morphAttributes.color||[];let b=0;g===!0&&(b=1),x===!0&&(b=2),m===!0&&(b=3);let E=a.attributes.position.count*b,T=1;E>t.maxTextureSize&&(T=Math.ceil(E/t.maxTextureSize),E=t.maxTextureSize);const v=new Float32Array(E*T*4*d),S=new mf(v,E,T,d);S.type=Nn,S.needsUpdate=!0;const N=b*4;for(let U=0;U<d;U++){const D=f[U],F=_[U],L=M[U],z=E*T*4*U;for(let $=0;$<D.count;$++){const k=$*N;g===!0&&(s.fromBufferAttribute(D,$),v[z+k+0]=s.x,v[z+k+1]=s.y,v[z+k+2]=s.z,v[z+k+3]=0),x===!0&&(s.fromBufferAttribute(F,$),v[z+k+4]=s.x,v[z+k+5]=s.y,v[z+k+6]=s.z,v[z+k+7]=0),m===!0&&(s.fromBufferAttribute(L,$),v[z+k+8]=s.x,v[z+k+9]=s.y,v[z+k+10]=s.z,v[z+k+11]=L.itemSize===4?s.w:1)}}u={count:d,texture:S,size:new It(E,T)},i.set(a,u),a.addEventListener("dispose",P)}if(o.isInstancedMesh===!0&&o.morphTexture!==null)l.getUniforms().setValue(n,"morphTexture",o.morphTexture,e);else{let g=0;for(let m=0;m<c.length;m++)g+=c[m];const x=a.morphTargetsRelative?1:1-g;l.getUniforms().setValue(n,"morphTargetBaseInfluence",x),l.getUniforms().setValue(n,"morphTargetInfluences",c)}l.getUniforms().setValue(n,"morphTargetsTexture",u.texture,e),l.getUniforms().setValue(n,"morphTargetsTextureSize",u.size)}return{update:r}}function Hb(n,t,e,i,s){let r=new WeakMap;function o(c){const h=s.render.frame,d=c.geometry,u=t.get(c,d);if(r.get(u)!==h&&(t.update(u),r.set(u,h)),c.isInstancedMesh&&(c.hasEventListener("dispose",l)===!1&&c.addEventListener("dispose",l),r.get(c)!==h&&(e.update(c.instanceMatrix,n.ARRAY_BUFFER),c.instanceColor!==null&&e.update(c.instanceColor,n.ARRAY_BUFFER),r.set(c,h))),c.isSkinnedMesh){const p=c.skeleton;r.get(p)!==h&&(p.update(),r.set(p,h))}return u}function a(){r=new WeakMap}function l(c){const h=c.target;h.removeEventListener("dispose",l),i.releaseStatesOfObject(h),e.remove(h.instanceMatrix),h.instanceColor!==null&&e.remove(h.instanceColor)}return{update:o,dispose:a}}const Gb={[qp]:"LINEAR_TONE_MAPPING",[$p]:"REINHARD_TONE_MAPPING",[Yp]:"CINEON_TONE_MAPPING",[Kp]:"ACES_FILMIC_TONE_MAPPING",[jp]:"AGX_TONE_MAPPING",[Qp]:"NEUTRAL_TONE_MAPPING",[Zp]:"CUSTOM_TONE_MAPPING"};function Wb(n,t,e,i,s,r){const o=new En(t,e,{type:n,depthBuffer:s,stencilBuffer:r,samples:i?4:0,storeMultisampledDepthBuffer:!1,storeMultisampledStencilBuffer:!1,resolveDepthBuffer:!1,resolveStencilBuffer:!1});let a=null,l=null,c=null;const h=new Ve;h.setAttribute("position",new me([-1,3,0,-1,-1,0,3,-1,0],3)),h.setAttribute("uv",new me([0,2,0,0,2,0],2));const d=new Fv({uniforms:{tDiffuse:{value:null}},vertexShader:`
			precision highp float;

			uniform mat4 modelViewMatrix;
			uniform mat4 projectionMatrix;

			attribute vec3 position;
			attribute vec2 uv;

			varying vec2 vUv;

			void main() {
				vUv = uv;
				gl_Position = projectionMatrix * modelViewMatrix * vec4( position, 1.0 );
			}`,fragmentShader:`
			precision highp float;

			uniform sampler2D tDiffuse;

			varying vec2 vUv;

			#include <tonemapping_pars_fragment>
			#include <colorspace_pars_fragment>

			void main() {
				gl_FragColor = texture2D( tDiffuse, vUv );

				#ifdef LINEAR_TONE_MAPPING
					gl_FragColor.rgb = LinearToneMapping( gl_FragColor.rgb );
				#elif defined( REINHARD_TONE_MAPPING )
					gl_FragColor.rgb = ReinhardToneMapping( gl_FragColor.rgb );
				#elif defined( CINEON_TONE_MAPPING )
					gl_FragColor.rgb = CineonToneMapping( gl_FragColor.rgb );
				#elif defined( ACES_FILMIC_TONE_MAPPING )
					gl_FragColor.rgb = ACESFilmicToneMapping( gl_FragColor.rgb );
				#elif defined( AGX_TONE_MAPPING )
					gl_FragColor.rgb = AgXToneMapping( gl_FragColor.rgb );
				#elif defined( NEUTRAL_TONE_MAPPING )
					gl_FragColor.rgb = NeutralToneMapping( gl_FragColor.rgb );
				#elif defined( CUSTOM_TONE_MAPPING )
					gl_FragColor.rgb = CustomToneMapping( gl_FragColor.rgb );
				#endif

				#ifdef SRGB_TRANSFER
					gl_FragColor = sRGBTransferOETF( gl_FragColor );
				#endif
			}`,depthTest:!1,depthWrite:!1}),u=new _t(h,d),p=new Af(-1,1,1,-1,0,1);let g=null,x=null,m=!1,f,_=null,M=[],b=!1;this.setSize=function(E,T){o.setSize(E,T),a!==null&&a.setSize(E,T),l!==null&&l.setSize(E,T);for(let v=0;v<M.length;v++){const S=M[v];S.setSize&&S.setSize(E,T)}},this.setEffects=function(E){M=E,b=M.length>0&&M[0].isRenderPass===!0;const T=o.width,v=o.height;M.length>0&&a===null&&(a=new En(T,v,{type:Yn,depthBuffer:!1,stencilBuffer:!1}),l=new En(T,v,{type:Yn,depthBuffer:!1,stencilBuffer:!1}));const S=s===!0&&M.some(N=>N.needsDepthTexture===!0);S!==(o.depthTexture!==null)&&(S===!0&&c===null&&(c=new Xs(T,v),r===!0&&(c.format=Ui,c.type=Ws)),o.dispose(),o.depthTexture=S?c:null,o.resolveDepthBuffer=S,o.storeMultisampledDepthBuffer=S);for(let N=0;N<M.length;N++){const P=M[N];P.setSize&&P.setSize(T,v),S&&P.needsDepthTexture===!0&&P.setDepthTexture&&P.setDepthTexture(c)}},this.begin=function(E,T){if(m||E.toneMapping===ci&&M.length===0)return!1;if(_=T,T!==null){const v=T.width,S=T.height;(o.width!==v||o.height!==S)&&this.setSize(v,S)}return b===!1&&E.setRenderTarget(o),f=E.toneMapping,E.toneMapping=ci,!0},this.hasRenderPass=function(){return b},this.end=function(E,T){E.toneMapping=f,m=!0;let v=o,S=a;for(let N=0;N<M.length;N++){const P=M[N];P.enabled!==!1&&(P.render(E,S,v,T),P.needsSwap!==!1&&(v=S,S=S===a?l:a))}if(g!==E.outputColorSpace||x!==E.toneMapping){g=E.outputColorSpace,x=E.toneMapping,d.defines={},qt.getTransfer(g)===re&&(d.defines.SRGB_TRANSFER="");const N=Gb[x];N&&(d.defines[N]=""),d.needsUpdate=!0}d.uniforms.tDiffuse.value=v.texture,E.setRenderTarget(_),E.render(u,p),_=null,m=!1},this.isCompositing=function(){return m},this.dispose=function(){o.dispose(),a!==null&&a.dispose(),l!==null&&l.dispose(),h.dispose(),d.dispose()}}const Nf=new je,Uf=new Xs(1,1),Of=new Sf(1),Ff=new mf,kf=new gv,Bf=new yf,Zu=[],ju=[],Qu=new Float32Array(16),Ju=new Float32Array(9),td=new Float32Array(4);function Qs(n,t,e){const i=n[0];if(i<=0||i>0)return n;const s=t*e;let r=Zu[s];if(r===void 0&&(r=new Float32Array(s),Zu[s]=r),t!==0){i.toArray(r,0);for(let o=1,a=0;o!==t;++o)a+=e,n[o].toArray(r,a)}return r}function Ue(n,t){if(n.length!==t.length)return!1;for(let e=0,i=n.length;e<i;e++)if(n[e]!==t[e])return!1;return!0}function Oe(n,t){for(let e=0,i=t.length;e<i;e++)n[e]=t[e]}function Ca(n,t){let e=ju[t];e===void 0&&(e=new Int32Array(t),ju[t]=e);for(let i=0;i!==t;++i)e[i]=n.allocateTextureUnit();return e}function Xb(n,t){const e=this.cache;e[0]!==t&&(n.uniform1f(this.addr,t),e[0]=t)}function qb(n,t){const e=this.cache;if(t.x!==void 0)(e[0]!==t.x||e[1]!==t.y)&&(n.uniform2f(this.addr,t.x,t.y),e[0]=t.x,e[1]=t.y);else{if(Ue(e,t))return;n.uniform2fv(this.addr,t),Oe(e,t)}}function $b(n,t){const e=this.cache;if(t.x!==void 0)(e[0]!==t.x||e[1]!==t.y||e[2]!==t.z)&&(n.uniform3f(this.addr,t.x,t.y,t.z),e[0]=t.x,e[1]=t.y,e[2]=t.z);else if(t.r!==void 0)(e[0]!==t.r||e[1]!==t.g||e[2]!==t.b)&&(n.uniform3f(this.addr,t.r,t.g,t.b),e[0]=t.r,e[1]=t.g,e[2]=t.b);else{if(Ue(e,t))return;n.uniform3fv(this.addr,t),Oe(e,t)}}function Yb(n,t){const e=this.cache;if(t.x!==void 0)(e[0]!==t.x||e[1]!==t.y||e[2]!==t.z||e[3]!==t.w)&&(n.uniform4f(this.addr,t.x,t.y,t.z,t.w),e[0]=t.x,e[1]=t.y,e[2]=t.z,e[3]=t.w);else{if(Ue(e,t))return;n.uniform4fv(this.addr,t),Oe(e,t)}}function Kb(n,t){const e=this.cache,i=t.elements;if(i===void 0){if(Ue(e,t))return;n.uniformMatrix2fv(this.addr,!1,t),Oe(e,t)}else{if(Ue(e,i))return;td.set(i),n.uniformMatrix2fv(this.addr,!1,td),Oe(e,i)}}function Zb(n,t){const e=this.cache,i=t.elements;if(i===void 0){if(Ue(e,t))return;n.uniformMatrix3fv(this.addr,!1,t),Oe(e,t)}else{if(Ue(e,i))return;Ju.set(i),n.uniformMatrix3fv(this.addr,!1,Ju),Oe(e,i)}}function jb(n,t){const e=this.cache,i=t.elements;if(i===void 0){if(Ue(e,t))return;n.uniformMatrix4fv(this.addr,!1,t),Oe(e,t)}else{if(Ue(e,i))return;Qu.set(i),n.uniformMatrix4fv(this.addr,!1,Qu),Oe(e,i)}}function Qb(n,t){const e=this.cache;e[0]!==t&&(n.uniform1i(this.addr,t),e[0]=t)}function Jb(n,t){const e=this.cache;if(t.x!==void 0)(e[0]!==t.x||e[1]!==t.y)&&(n.uniform2i(this.addr,t.x,t.y),e[0]=t.x,e[1]=t.y);else{if(Ue(e,t))return;n.uniform2iv(this.addr,t),Oe(e,t)}}function tw(n,t){const e=this.cache;if(t.x!==void 0)(e[0]!==t.x||e[1]!==t.y||e[2]!==t.z)&&(n.uniform3i(this.addr,t.x,t.y,t.z),e[0]=t.x,e[1]=t.y,e[2]=t.z);else{if(Ue(e,t))return;n.uniform3iv(this.addr,t),Oe(e,t)}}function ew(n,t){const e=this.cache;if(t.x!==void 0)(e[0]!==t.x||e[1]!==t.y||e[2]!==t.z||e[3]!==t.w)&&(n.uniform4i(this.addr,t.x,t.y,t.z,t.w),e[0]=t.x,e[1]=t.y,e[2]=t.z,e[3]=t.w);else{if(Ue(e,t))return;n.uniform4iv(this.addr,t),Oe(e,t)}}function nw(n,t){const e=this.cache;e[0]!==t&&(n.uniform1ui(this.addr,t),e[0]=t)}function iw(n,t){const e=this.cache;if(t.x!==void 0)(e[0]!==t.x||e[1]!==t.y)&&(n.uniform2ui(this.addr,t.x,t.y),e[0]=t.x,e[1]=t.y);else{if(Ue(e,t))return;n.uniform2uiv(this.addr,t),Oe(e,t)}}function sw(n,t){const e=this.cache;if(t.x!==void 0)(e[0]!==t.x||e[1]!==t.y||e[2]!==t.z)&&(n.uniform3ui(this.addr,t.x,t.y,t.z),e[0]=t.x,e[1]=t.y,e[2]=t.z);else{if(Ue(e,t))return;n.uniform3uiv(this.addr,t),Oe(e,t)}}function rw(n,t){const e=this.cache;if(t.x!==void 0)(e[0]!==t.x||e[1]!==t.y||e[2]!==t.z||e[3]!==t.w)&&(n.uniform4ui(this.addr,t.x,t.y,t.z,t.w),e[0]=t.x,e[1]=t.y,e[2]=t.z,e[3]=t.w);else{if(Ue(e,t))return;n.uniform4uiv(this.addr,t),Oe(e,t)}}function Ra(n){return n.version===0&&(n.compareFunction=cf,n.needsUpdate=!0),n}function ow(n,t,e){const i=this.cache,s=e.allocateTextureUnit();i[0]!==s&&(n.uniform1i(this.addr,s),i[0]=s);let r;this.type===n.SAMPLER_2D_SHADOW?r=Ra(Uf):r=Nf,e.setTexture2D(t||r,s)}function aw(n,t,e){const i=this.cache,s=e.allocateTextureUnit();i[0]!==s&&(n.uniform1i(this.addr,s),i[0]=s),e.setTexture3D(t||kf,s)}function lw(n,t,e){const i=this.cache,s=e.allocateTextureUnit();i[0]!==s&&(n.uniform1i(this.addr,s),i[0]=s);let r;this.type===n.SAMPLER_CUBE_SHADOW?r=Ra(Of):r=Bf,e.setTextureCube(t||r,s)}function cw(n,t,e){const i=this.cache,s=e.allocateTextureUnit();i[0]!==s&&(n.uniform1i(this.addr,s),i[0]=s),e.setTexture2DArray(t||Ff,s)}function hw(n){switch(n){case 5126:return Xb;case 35664:return qb;case 35665:return $b;case 35666:return Yb;case 35674:return Kb;case 35675:return Zb;case 35676:return jb;case 5124:case 35670:return Qb;case 35667:case 35671:return Jb;case 35668:case 35672:return tw;case 35669:case 35673:return ew;case 5125:return nw;case 36294:return iw;case 36295:return sw;case 36296:return rw;case 35678:case 36198:case 36298:case 36306:case 35682:return ow;case 35679:case 36299:case 36307:return aw;case 35680:case 36300:case 36308:case 36293:return lw;case 36289:case 36303:case 36311:case 36292:return cw}}function uw(n,t){n.uniform1fv(this.addr,t)}function dw(n,t){const e=Qs(t,this.size,2);n.uniform2fv(this.addr,e)}function pw(n,t){const e=Qs(t,this.size,3);n.uniform3fv(this.addr,e)}function fw(n,t){const e=Qs(t,this.size,4);n.uniform4fv(this.addr,e)}function mw(n,t){const e=Qs(t,this.size,4);n.uniformMatrix2fv(this.addr,!1,e)}function gw(n,t){const e=Qs(t,this.size,9);n.uniformMatrix3fv(this.addr,!1,e)}function vw(n,t){const e=Qs(t,this.size,16);n.uniformMatrix4fv(this.addr,!1,e)}function _w(n,t){n.uniform1iv(this.addr,t)}function xw(n,t){n.uniform2iv(this.addr,t)}function bw(n,t){n.uniform3iv(this.addr,t)}function ww(n,t){n.uniform4iv(this.addr,t)}function yw(n,t){n.uniform1uiv(this.addr,t)}function Sw(n,t){n.uniform2uiv(this.addr,t)}function Ew(n,t){n.uniform3uiv(this.addr,t)}function Mw(n,t){n.uniform4uiv(this.addr,t)}function Tw(n,t,e){const i=this.cache,s=t.length,r=Ca(e,s);Ue(i,r)||(n.uniform1iv(this.addr,r),Oe(i,r));let o;this.type===n.SAMPLER_2D_SHADOW?o=Ra(Uf):o=Nf;for(let a=0;a!==s;++a)e.setTexture2D(t[a]||o,r[a])}function Aw(n,t,e){const i=this.cache,s=t.length,r=Ca(e,s);Ue(i,r)||(n.uniform1iv(this.addr,r),Oe(i,r));for(let o=0;o!==s;++o)e.setTexture3D(t[o]||kf,r[o])}function Cw(n,t,e){const i=this.cache,s=t.length,r=Ca(e,s);Ue(i,r)||(n.uniform1iv(this.addr,r),Oe(i,r));let o;this.type===n.SAMPLER_CUBE_SHADOW?o=Ra(Of):o=Bf;for(let a=0;a!==s;++a)e.setTextureCube(t[a]||o,r[a])}function Rw(n,t,e){const i=this.cache,s=t.length,r=Ca(e,s);Ue(i,r)||(n.uniform1iv(this.addr,r),Oe(i,r));for(let o=0;o!==s;++o)e.setTexture2DArray(t[o]||Ff,r[o])}function Pw(n){switch(n){case 5126:return uw;case 35664:return dw;case 35665:return pw;case 35666:return fw;case 35674:return mw;case 35675:return gw;case 35676:return vw;case 5124:case 35670:return _w;case 35667:case 35671:return xw;case 35668:case 35672:return bw;case 35669:case 35673:return ww;case 5125:return yw;case 36294:return Sw;case 36295:return Ew;case 36296:return Mw;case 35678:case 36198:case 36298:case 36306:case 35682:return Tw;case 35679:case 36299:case 36307:return Aw;case 35680:case 36300:case 36308:case 36293:return Cw;case 36289:case 36303:case 36311:case 36292:return Rw}}class Lw{constructor(t,e,i){this.id=t,this.addr=i,this.cache=[],this.type=e.type,this.setValue=hw(e.type)}}class Dw{constructor(t,e,i){this.id=t,this.addr=i,this.cache=[],this.type=e.type,this.size=e.size,this.setValue=Pw(e.type)}}class Iw{constructor(t){this.id=t,this.seq=[],this.map={}}setValue(t,e,i){const s=this.seq;for(let r=0,o=s.length;r!==o;++r){const a=s[r];a.setValue(t,e[a.id],i)}}}const fl=/(\w+)(\])?(\[|\.)?/g;function ed(n,t){n.seq.push(t),n.map[t.id]=t}function Nw(n,t,e){const i=n.name,s=i.length;for(fl.lastIndex=0;;){const r=fl.exec(i),o=fl.lastIndex;let a=r[1];const l=r[2]==="]",c=r[3];if(l&&(a=a|0),c===void 0||c==="["&&o+2===s){ed(e,c===void 0?new Lw(a,n,t):new Dw(a,n,t));break}else{let d=e.map[a];d===void 0&&(d=new Iw(a),ed(e,d)),e=d}}}class Jo{constructor(t,e){this.seq=[],this.map={};const i=t.getProgramParameter(e,t.ACTIVE_UNIFORMS);for(let o=0;o<i;++o){const a=t.getActiveUniform(e,o),l=t.getUniformLocation(e,a.name);Nw(a,l,this)}const s=[],r=[];for(const o of this.seq)o.type===t.SAMPLER_2D_SHADOW||o.type===t.SAMPLER_CUBE_SHADOW||o.type===t.SAMPLER_2D_ARRAY_SHADOW?s.push(o):r.push(o);s.length>0&&(this.seq=s.concat(r))}setValue(t,e,i,s){const r=this.map[e];r!==void 0&&r.setValue(t,i,s)}setOptional(t,e,i){const s=e[i];s!==void 0&&this.setValue(t,i,s)}static upload(t,e,i,s){for(let r=0,o=e.length;r!==o;++r){const a=e[r],l=i[a.id];l.needsUpdate!==!1&&a.setValue(t,l.value,s)}}static seqWithValue(t,e){const i=[];for(let s=0,r=t.length;s!==r;++s){const o=t[s];o.id in e&&i.push(o)}return i}}function nd(n,t,e){const i=n.createShader(t);return n.shaderSource(i,e),n.compileShader(i),i}const Uw=37297;let Ow=0;function Fw(n,t){const e=n.split(`
`),i=[],s=Math.max(t-6,0),r=Math.min(t+6,e.length);for(let o=s;o<r;o++){const a=o+1;i.push(`${a===t?">":" "} ${a}: ${e[o]}`)}return i.join(`
`)}const id=new Lt;function kw(n){qt._getMatrix(id,qt.workingColorSpace,n);const t=`mat3( ${id.elements.map(e=>e.toFixed(4))} )`;switch(qt.getTransfer(n)){case ca:return[t,"LinearTransferOETF"];case re:return[t,"sRGBTransferOETF"];default:return Dt("WebGLProgram: Unsupported color space: ",n),[t,"LinearTransferOETF"]}}function sd(n,t,e){const i=n.getShaderParameter(t,n.COMPILE_STATUS),r=(n.getShaderInfoLog(t)||"").trim();if(i&&r==="")return"";const o=/ERROR: 0:(\d+)/.exec(r);if(o){const a=parseInt(o[1]);return e.toUpperCase()+`

`+r+`

`+Fw(n.getShaderSource(t),a)}else return r}function Bw(n,t){const e=kw(t);return[`vec4 ${n}( vec4 value ) {`,`	return ${e[1]}( vec4( ${e[0]} * value.rgb, value.a ) );`,"}"].join(`
`)}const zw={[qp]:"Linear",[$p]:"Reinhard",[Yp]:"Cineon",[Kp]:"ACESFilmic",[jp]:"AgX",[Qp]:"Neutral",[Zp]:"Custom"};function Vw(n,t){const e=zw[t];return e===void 0?(Dt("WebGLProgram: Unsupported toneMapping:",t),"vec3 "+n+"( vec3 color ) { return LinearToneMapping( color ); }"):"vec3 "+n+"( vec3 color ) { return "+e+"ToneMapping( color ); }"}const Oo=new C;function Hw(){qt.getLuminanceCoefficients(Oo);const n=Oo.x.toFixed(4),t=Oo.y.toFixed(4),e=Oo.z.toFixed(4);return["float luminance( const in vec3 rgb ) {",`	const vec3 weights = vec3( ${n}, ${t}, ${e} );`,"	return dot( weights, rgb );","}"].join(`
`)}function Gw(n){return[n.extensionClipCullDistance?"#extension GL_ANGLE_clip_cull_distance : require":"",n.extensionMultiDraw?"#extension GL_ANGLE_multi_draw : require":""].filter(xr).join(`
`)}function Ww(n){const t=[];for(const e in n){const i=n[e];i!==!1&&t.push("#define "+e+" "+i)}return t.join(`
`)}function Xw(n,t){const e={},i=n.getProgramParameter(t,n.ACTIVE_ATTRIBUTES);for(let s=0;s<i;s++){const r=n.getActiveAttrib(t,s),o=r.name;let a=1;r.type===n.FLOAT_MAT2&&(a=2),r.type===n.FLOAT_MAT3&&(a=3),r.type===n.FLOAT_MAT4&&(a=4),e[o]={type:r.type,location:n.getAttribLocation(t,o),locationSize:a}}return e}function xr(n){return n!==""}function rd(n,t){const e=t.numSpotLightShadows+t.numSpotLightMaps-t.numSpotLightShadowsWithMaps;return n.replace(/NUM_SUN_LIGHTS/g,t.numSunLights).replace(/NUM_DIR_LIGHTS/g,t.numDirLights).replace(/NUM_SPOT_LIGHTS/g,t.numSpotLights).replace(/NUM_SPOT_LIGHT_MAPS/g,t.numSpotLightMaps).replace(/NUM_SPOT_LIGHT_COORDS/g,e).replace(/NUM_RECT_AREA_LIGHTS/g,t.numRectAreaLights).replace(/NUM_POINT_LIGHTS/g,t.numPointLights).replace(/NUM_HEMI_LIGHTS/g,t.numHemiLights).replace(/NUM_SUN_LIGHT_SHADOWS/g,t.numSunLightShadows).replace(/NUM_DIR_LIGHT_SHADOWS/g,t.numDirLightShadows).replace(/NUM_SPOT_LIGHT_SHADOWS_WITH_MAPS/g,t.numSpotLightShadowsWithMaps).replace(/NUM_SPOT_LIGHT_SHADOWS/g,t.numSpotLightShadows).replace(/NUM_POINT_LIGHT_SHADOWS/g,t.numPointLightShadows).replace(/NUM_LIGHT_PROBE_GRIDS/g,t.numLightProbeGrids)}function od(n,t){return n.replace(/NUM_CLIPPING_PLANES/g,t.numClippingPlanes).replace(/UNION_CLIPPING_PLANES/g,t.numClippingPlanes-t.numClipIntersection)}const qw=/^[ \t]*#include +<([\w\d./]+)>/gm;function Ac(n){return n.replace(qw,$w)}function $w(n,t){const e=zt[t];if(e===void 0)throw new Error("THREE.WebGLProgram: Can not resolve #include <"+t+">");return Ac(e)}const Yw=/#pragma unroll_loop_start\s+for\s*\(\s*int\s+i\s*=\s*(\d+)\s*;\s*i\s*<\s*(\d+)\s*;\s*i\s*\+\+\s*\)\s*{([\s\S]+?)}\s+#pragma unroll_loop_end/g;function ad(n){return n.replace(Yw,Kw)}function Kw(n,t,e,i){let s="";for(let r=parseInt(t);r<parseInt(e);r++)s+=i.replace(/\[\s*i\s*\]/g,"[ "+r+" ]").replace(/UNROLLED_LOOP_INDEX/g,r);return s}function ld(n){let t=`precision ${n.precision} float;
	precision ${n.precision} int;
	precision ${n.precision} sampler2D;
	precision ${n.precision} samplerCube;
	precision ${n.precision} sampler3D;
	precision ${n.precision} sampler2DArray;
	precision ${n.precision} sampler2DShadow;
	precision ${n.precision} samplerCubeShadow;
	precision ${n.precision} sampler2DArrayShadow;
	precision ${n.precision} isampler2D;
	precision ${n.precision} isampler3D;
	precision ${n.precision} isamplerCube;
	precision ${n.precision} isampler2DArray;
	precision ${n.precision} usampler2D;
	precision ${n.precision} usampler3D;
	precision ${n.precision} usamplerCube;
	precision ${n.precision} usampler2DArray;
	`;return n.precision==="highp"?t+=`
#define HIGH_PRECISION`:n.precision==="mediump"?t+=`
#define MEDIUM_PRECISION`:n.precision==="lowp"&&(t+=`
#define LOW_PRECISION`),t}const Zw={[$o]:"SHADOWMAP_TYPE_PCF",[_r]:"SHADOWMAP_TYPE_VSM"};function jw(n){return Zw[n.shadowMapType]||"SHADOWMAP_TYPE_BASIC"}const Qw={[Lr]:"ENVMAP_MODE_REFRACTION"};function Jw(n){return n.envMap===!1?"ENVMAP_MODE_REFLECTION":Qw[n.envMapMode]||"ENVMAP_MODE_REFLECTION"}const ty={[Xp]:"ENVMAP_BLENDING_MULTIPLY",[N0]:"ENVMAP_BLENDING_MIX",[U0]:"ENVMAP_BLENDING_ADD"};function ey(n){return n.envMap===!1?"ENVMAP_BLENDING_NONE":ty[n.combine]||"ENVMAP_BLENDING_NONE"}function ny(n,t,e,i){const s=n.getContext(),r=e.defines;let o=e.vertexShader,a=e.fragmentShader;const l=jw(e),c=e.envMapPMREM===!0?"ENVMAP_TYPE_PMREM":"ENVMAP_TYPE_CUBE",h=Jw(e),d=ey(e),u=Gw(e),p=Ww(r),g=s.createProgram();let x,m,f=e.glslVersion?"#version "+e.glslVersion+`
`:"";e.isRawShaderMaterial?(x=["#define SHADER_TYPE "+e.shaderType,"#define SHADER_NAME "+e.shaderName,p].filter(xr).join(`
`),x.length>0&&(x+=`
`),m=["#define SHADER_TYPE "+e.shaderType,"#define SHADER_NAME "+e.shaderName,p].filter(xr).join(`
`),m.length>0&&(m+=`
`)):(x=[ld(e),"#define SHADER_TYPE "+e.shaderType,"#define SHADER_NAME "+e.shaderName,p,e.extensionClipCullDistance?"#define USE_CLIP_DISTANCE":"",e.batching?"#define USE_BATCHING":"",e.batchingColor?"#define USE_BATCHING_COLOR":"",e.instancing?"#define USE_INSTANCING":"",e.instancingColor?"#define USE_INSTANCING_COLOR":"",e.instancingMorph?"#define USE_INSTANCING_MORPH":"",e.useFog&&e.fog?"#define USE_FOG":"",e.useFog&&e.fogExp2?"#define FOG_EXP2":"",e.map?"#define USE_MAP":"",e.envMap?"#define USE_ENVMAP":"",e.envMap?"#define "+h:"",e.lightMap?"#define USE_LIGHTMAP":"",e.aoMap?"#define USE_AOMAP":"",e.bumpMap?"#define USE_BUMPMAP":"",e.normalMap?"#define USE_NORMALMAP":"",e.normalMapObjectSpace?"#define USE_NORMALMAP_OBJECTSPACE":"",e.normalMapTangentSpace?"#define USE_NORMALMAP_TANGENTSPACE":"",e.displacementMap?"#define USE_DISPLACEMENTMAP":"",e.emissiveMap?"#define USE_EMISSIVEMAP":"",e.anisotropy?"#define USE_ANISOTROPY":"",e.anisotropyMap?"#define USE_ANISOTROPYMAP":"",e.clearcoatMap?"#define USE_CLEARCOATMAP":"",e.clearcoatRoughnessMap?"#define USE_CLEARCOAT_ROUGHNESSMAP":"",e.clearcoatNormalMap?"#define USE_CLEARCOAT_NORMALMAP":"",e.diffuseRoughnessMap?"#define USE_DIFFUSE_ROUGHNESSMAP":"",e.iridescenceMap?"#define USE_IRIDESCENCEMAP":"",e.iridescenceThicknessMap?"#define USE_IRIDESCENCE_THICKNESSMAP":"",e.specularMap?"#define USE_SPECULARMAP":"",e.specularColorMap?"#define USE_SPECULAR_COLORMAP":"",e.specularIntensityMap?"#define USE_SPECULAR_INTENSITYMAP":"",e.roughnessMap?"#define USE_ROUGHNESSMAP":"",e.metalnessMap?"#define USE_METALNESSMAP":"",e.alphaMap?"#define USE_ALPHAMAP":"",e.alphaHash?"#define USE_ALPHAHASH":"",e.transmission?"#define USE_TRANSMISSION":"",e.transmissionMap?"#define USE_TRANSMISSIONMAP":"",e.thicknessMap?"#define USE_THICKNESSMAP":"",e.sheenColorMap?"#define USE_SHEEN_COLORMAP":"",e.sheenRoughnessMap?"#define USE_SHEEN_ROUGHNESSMAP":"",e.mapUv?"#define MAP_UV "+e.mapUv:"",e.alphaMapUv?"#define ALPHAMAP_UV "+e.alphaMapUv:"",e.lightMapUv?"#define LIGHTMAP_UV "+e.lightMapUv:"",e.aoMapUv?"#define AOMAP_UV "+e.aoMapUv:"",e.emissiveMapUv?"#define EMISSIVEMAP_UV "+e.emissiveMapUv:"",e.bumpMapUv?"#define BUMPMAP_UV "+e.bumpMapUv:"",e.normalMapUv?"#define NORMALMAP_UV "+e.normalMapUv:"",e.displacementMapUv?"#define DISPLACEMENTMAP_UV "+e.displacementMapUv:"",e.metalnessMapUv?"#define METALNESSMAP_UV "+e.metalnessMapUv:"",e.roughnessMapUv?"#define ROUGHNESSMAP_UV "+e.roughnessMapUv:"",e.anisotropyMapUv?"#define ANISOTROPYMAP_UV "+e.anisotropyMapUv:"",e.clearcoatMapUv?"#define CLEARCOATMAP_UV "+e.clearcoatMapUv:"",e.clearcoatNormalMapUv?"#define CLEARCOAT_NORMALMAP_UV "+e.clearcoatNormalMapUv:"",e.clearcoatRoughnessMapUv?"#define CLEARCOAT_ROUGHNESSMAP_UV "+e.clearcoatRoughnessMapUv:"",e.diffuseRoughnessMapUv?"#define DIFFUSE_ROUGHNESSMAP_UV "+e.diffuseRoughnessMapUv:"",e.iridescenceMapUv?"#define IRIDESCENCEMAP_UV "+e.iridescenceMapUv:"",e.iridescenceThicknessMapUv?"#define IRIDESCENCE_THICKNESSMAP_UV "+e.iridescenceThicknessMapUv:"",e.sheenColorMapUv?"#define SHEEN_COLORMAP_UV "+e.sheenColorMapUv:"",e.sheenRoughnessMapUv?"#define SHEEN_ROUGHNESSMAP_UV "+e.sheenRoughnessMapUv:"",e.specularMapUv?"#define SPECULARMAP_UV "+e.specularMapUv:"",e.specularColorMapUv?"#define SPECULAR_COLORMAP_UV "+e.specularColorMapUv:"",e.specularIntensityMapUv?"#define SPECULAR_INTENSITYMAP_UV "+e.specularIntensityMapUv:"",e.transmissionMapUv?"#define TRANSMISSIONMAP_UV "+e.transmissionMapUv:"",e.thicknessMapUv?"#define THICKNESSMAP_UV "+e.thicknessMapUv:"",e.vertexTangents&&e.flatShading===!1?"#define USE_TANGENT":"",e.vertexNormals?"#define HAS_NORMAL":"",e.vertexColors?"#define USE_COLOR":"",e.vertexAlphas?"#define USE_COLOR_ALPHA":"",e.vertexUv1s?"#define USE_UV1":"",e.vertexUv2s?"#define USE_UV2":"",e.vertexUv3s?"#define USE_UV3":"",e.pointsUvs?"#define USE_POINTS_UV":"",e.flatShading?"#define FLAT_SHADED":"",e.skinning?"#define USE_SKINNING":"",e.morphTargets?"#define USE_MORPHTARGETS":"",e.morphNormals&&e.flatShading===!1?"#define USE_MORPHNORMALS":"",e.morphColors?"#define USE_MORPHCOLORS":"",e.morphTargetsCount>0?"#define MORPHTARGETS_TEXTURE_STRIDE "+e.morphTextureStride:"",e.morphTargetsCount>0?"#define MORPHTARGETS_COUNT "+e.morphTargetsCount:"",e.doubleSided?"#define DOUBLE_SIDED":"",e.flipSided?"#define FLIP_SIDED":"",e.shadowMapEnabled?"#define USE_SHADOWMAP":"",e.shadowMapEnabled?"#define "+l:"",e.sizeAttenuation?"#define USE_SIZEATTENUATION":"",e.numLightProbes>0?"#define USE_LIGHT_PROBES":"",e.logarithmicDepthBuffer?"#define USE_LOGARITHMIC_DEPTH_BUFFER":"",e.reversedDepthBuffer?"#define USE_REVERSED_DEPTH_BUFFER":"","uniform mat4 modelMatrix;","uniform mat4 modelViewMatrix;","uniform mat4 projectionMatrix;","uniform mat4 viewMatrix;","uniform mat3 normalMatrix;","uniform vec3 cameraPosition;","uniform bool isOrthographic;","#ifdef USE_INSTANCING","	attribute mat4 instanceMatrix;","#endif","#ifdef USE_INSTANCING_COLOR","	attribute vec3 instanceColor;","#endif","#ifdef USE_INSTANCING_MORPH","	uniform sampler2D morphTexture;","#endif","attribute vec3 position;","attribute vec3 normal;","attribute vec2 uv;","#ifdef USE_UV1","	attribute vec2 uv1;","#endif","#ifdef USE_UV2","	attribute vec2 uv2;","#endif","#ifdef USE_UV3","	attribute vec2 uv3;","#endif","#ifdef USE_TANGENT","	attribute vec4 tangent;","#endif","#if defined( USE_COLOR_ALPHA )","	attribute vec4 color;","#elif defined( USE_COLOR )","	attribute vec3 color;","#endif","#ifdef USE_SKINNING","	attribute vec4 skinIndex;","	attribute vec4 skinWeight;","#endif",`
`].filter(xr).join(`
`),m=[ld(e),"#define SHADER_TYPE "+e.shaderType,"#define SHADER_NAME "+e.shaderName,p,e.useFog&&e.fog?"#define USE_FOG":"",e.useFog&&e.fogExp2?"#define FOG_EXP2":"",e.alphaToCoverage?"#define ALPHA_TO_COVERAGE":"",e.map?"#define USE_MAP":"",e.matcap?"#define USE_MATCAP":"",e.envMap?"#define USE_ENVMAP":"",e.envMap?"#define "+c:"",e.envMap?"#define "+h:"",e.envMap?"#define "+d:"",e.envMapPMREM?"#define ENVMAP_MAX_LOD "+e.envMapMaxLod+".0":"",e.envMapPMREM?"#define ENVMAP_SIZE "+e.envMapSize+".0":"",e.lightMap?"#define USE_LIGHTMAP":"",e.aoMap?"#define USE_AOMAP":"",e.bumpMap?"#define USE_BUMPMAP":"",e.normalMap?"#define USE_NORMALMAP":"",e.normalMapObjectSpace?"#define USE_NORMALMAP_OBJECTSPACE":"",e.normalMapTangentSpace?"#define USE_NORMALMAP_TANGENTSPACE":"",e.packedNormalMap?"#define USE_PACKED_NORMALMAP":"",e.emissiveMap?"#define USE_EMISSIVEMAP":"",e.anisotropy?"#define USE_ANISOTROPY":"",e.anisotropyMap?"#define USE_ANISOTROPYMAP":"",e.clearcoat?"#define USE_CLEARCOAT":"",e.clearcoatMap?"#define USE_CLEARCOATMAP":"",e.clearcoatRoughnessMap?"#define USE_CLEARCOAT_ROUGHNESSMAP":"",e.clearcoatNormalMap?"#define USE_CLEARCOAT_NORMALMAP":"",e.diffuseRoughness?"#define USE_DIFFUSE_ROUGHNESS":"",e.diffuseRoughnessMap?"#define USE_DIFFUSE_ROUGHNESSMAP":"",e.dispersion?"#define USE_DISPERSION":"",e.retroreflection?"#define USE_RETROREFLECTION":"",e.iridescence?"#define USE_IRIDESCENCE":"",e.iridescenceMap?"#define USE_IRIDESCENCEMAP":"",e.iridescenceThicknessMap?"#define USE_IRIDESCENCE_THICKNESSMAP":"",e.specularMap?"#define USE_SPECULARMAP":"",e.specularColorMap?"#define USE_SPECULAR_COLORMAP":"",e.specularIntensityMap?"#define USE_SPECULAR_INTENSITYMAP":"",e.roughnessMap?"#define USE_ROUGHNESSMAP":"",e.metalnessMap?"#define USE_METALNESSMAP":"",e.alphaMap?"#define USE_ALPHAMAP":"",e.alphaTest?"#define USE_ALPHATEST":"",e.alphaHash?"#define USE_ALPHAHASH":"",e.sheen?"#define USE_SHEEN":"",e.sheenColorMap?"#define USE_SHEEN_COLORMAP":"",e.sheenRoughnessMap?"#define USE_SHEEN_ROUGHNESSMAP":"",e.transmission?"#define USE_TRANSMISSION":"",e.transmissionMap?"#define USE_TRANSMISSIONMAP":"",e.thicknessMap?"#define USE_THICKNESSMAP":"",e.vertexTangents&&e.flatShading===!1?"#define USE_TANGENT":"",e.vertexColors||e.instancingColor?"#define USE_COLOR":"",e.vertexAlphas||e.batchingColor?"#define USE_COLOR_ALPHA":"",e.vertexUv1s?"#define USE_UV1":"",e.vertexUv2s?"#define USE_UV2":"",e.vertexUv3s?"#define USE_UV3":"",e.pointsUvs?"#define USE_POINTS_UV":"",e.gradientMap?"#define USE_GRADIENTMAP":"",e.flatShading?"#define FLAT_SHADED":"",e.doubleSided?"#define DOUBLE_SIDED":"",e.flipSided?"#define FLIP_SIDED":"",e.shadowMapEnabled?"#define USE_SHADOWMAP":"",e.shadowMapEnabled?"#define "+l:"",e.premultipliedAlpha?"#define PREMULTIPLIED_ALPHA":"",e.numLightProbes>0?"#define USE_LIGHT_PROBES":"",e.decodeVideoTexture?"#define DECODE_VIDEO_TEXTURE":"",e.decodeVideoTextureEmissive?"#define DECODE_VIDEO_TEXTURE_EMISSIVE":"",e.logarithmicDepthBuffer?"#define USE_LOGARITHMIC_DEPTH_BUFFER":"",e.reversedDepthBuffer?"#define USE_REVERSED_DEPTH_BUFFER":"","uniform mat4 viewMatrix;","uniform vec3 cameraPosition;","uniform bool isOrthographic;",e.toneMapping!==ci?"#define TONE_MAPPING":"",e.toneMapping!==ci?zt.tonemapping_pars_fragment:"",e.toneMapping!==ci?Vw("toneMapping",e.toneMapping):"",e.dithering?"#define DITHERING":"",e.opaque?"#define OPAQUE":"",zt.colorspace_pars_fragment,Bw("linearToOutputTexel",e.outputColorSpace),Hw(),e.useDepthPacking?"#define DEPTH_PACKING "+e.depthPacking:"",`
`].filter(xr).join(`
`)),o=Ac(o),o=rd(o,e),o=od(o,e),a=Ac(a),a=rd(a,e),a=od(a,e),o=ad(o),a=ad(a),e.isRawShaderMaterial!==!0&&(f=`#version 300 es
`,x=[u,"#define attribute in","#define varying out","#define texture2D texture"].join(`
`)+`
`+x,m=["#define varying in",e.glslVersion===zi?"":"layout(location = 0) out highp vec4 pc_fragColor;",e.glslVersion===zi?"":"#define gl_FragColor pc_fragColor","#define gl_FragDepthEXT gl_FragDepth","#define texture2D texture","#define textureCube texture","#define texture2DProj textureProj","#define texture2DLodEXT textureLod","#define texture2DProjLodEXT textureProjLod","#define textureCubeLodEXT textureLod","#define texture2DGradEXT textureGrad","#define texture2DProjGradEXT textureProjGrad","#define textureCubeGradEXT textureGrad"].join(`
`)+`
`+m);const _=f+x+o,M=f+m+a,b=nd(s,s.VERTEX_SHADER,_),E=nd(s,s.FRAGMENT_SHADER,M);s.attachShader(g,b),s.attachShader(g,E),e.index0AttributeName!==void 0?s.bindAttribLocation(g,0,e.index0AttributeName):e.hasPositionAttribute===!0&&s.bindAttribLocation(g,0,"position"),s.linkProgram(g);function T(P){if(n.debug.checkShaderErrors){const U=s.getProgramInfoLog(g)||"",D=s.getShaderInfoLog(b)||"",F=s.getShaderInfoLog(E)||"",L=U.trim(),z=D.trim(),$=F.trim();let k=!0,tt=!0;if(s.getProgramParameter(g,s.LINK_STATUS)===!1)if(k=!1,typeof n.debug.onShaderError=="function")n.debug.onShaderError(s,g,b,E);else{const W=sd(s,b,"vertex"),Q=sd(s,E,"fragment");Qt("WebGLProgram: Shader Error "+s.getError()+" - VALIDATE_STATUS "+s.getProgramParameter(g,s.VALIDATE_STATUS)+`

Material Name: `+P.name+`
Material Type: `+P.type+`

Program Info Log: `+L+`
`+W+`
`+Q)}else L!==""?Dt("WebGLProgram: Program Info Log:",L):(z===""||$==="")&&(tt=!1);tt&&(P.diagnostics={runnable:k,programLog:L,vertexShader:{log:z,prefix:x},fragmentShader:{log:$,prefix:m}})}s.deleteShader(b),s.deleteShader(E),v=new Jo(s,g),S=Xw(s,g)}let v;this.getUniforms=function(){return v===void 0&&T(this),v};let S;this.getAttributes=function(){return S===void 0&&T(this),S};let N=e.rendererExtensionParallelShaderCompile===!1;return this.isReady=function(){return N===!1&&(N=s.getProgramParameter(g,Uw)),N},this.destroy=function(){i.releaseStatesOfProgram(this),s.deleteProgram(g),this.program=void 0},this.type=e.shaderType,this.name=e.shaderName,this.id=Ow++,this.cacheKey=t,this.usedTimes=1,this.program=g,this.vertexShader=b,this.fragmentShader=E,this}let iy=0;class sy{constructor(){this.shaderCache=new Map,this.materialCache=new Map}update(t,e,i){const s=this._getShaderCacheForMaterial(t);return s.has(e)===!1&&(s.add(e),e.usedTimes++),s.has(i)===!1&&(s.add(i),i.usedTimes++),this}remove(t){const e=this.materialCache.get(t);for(const i of e)i.usedTimes--,i.usedTimes===0&&this.shaderCache.delete(i.code);return this.materialCache.delete(t),this}getVertexShaderStage(t){return this._getShaderStage(t.vertexShader)}getFragmentShaderStage(t){return this._getShaderStage(t.fragmentShader)}dispose(){this.shaderCache.clear(),this.materialCache.clear()}_getShaderCacheForMaterial(t){const e=this.materialCache;let i=e.get(t);return i===void 0&&(i=new Set,e.set(t,i)),i}_getShaderStage(t){const e=this.shaderCache;let i=e.get(t);return i===void 0&&(i=new ry(t),e.set(t,i)),i}}class ry{constructor(t){this.id=iy++,this.code=t,this.usedTimes=0}}function oy(n){return n===is||n===oa||n===aa}function ay(n,t,e,i,s,r){const o=new eh,a=new sy,l=new Set,c=[],h=new Map,d=i.logarithmicDepthBuffer,u={MeshDepthMaterial:"depth",MeshDistanceMaterial:"distance",MeshNormalMaterial:"normal",MeshBasicMaterial:"basic",MeshLambertMaterial:"lambert",MeshPhongMaterial:"phong",MeshToonMaterial:"toon",MeshStandardMaterial:"physical",MeshPhysicalMaterial:"physical",MeshMatcapMaterial:"matcap",LineBasicMaterial:"basic",LineDashedMaterial:"dashed",PointsMaterial:"points",ShadowMaterial:"shadow",SpriteMaterial:"sprite"};function p(v){return l.add(v),v===0?"uv":`uv${v}`}function g(v,S,N,P,U,D){const F=P.fog,L=U.geometry,z=v.isMeshStandardMaterial||v.isMeshLambertMaterial||v.isMeshPhongMaterial?P.environment:null,$=v.isMeshStandardMaterial||v.isMeshLambertMaterial&&!v.envMap||v.isMeshPhongMaterial&&!v.envMap,k=t.get(v.envMap||z,$),tt=u[v.type];let W=i.precision;v.precision!==null&&(W=i.getMaxPrecision(v.precision),W!==v.precision&&Dt("WebGLProgram.getParameters:",v.precision,"not supported, using",W,"instead."));const Q=L.morphAttributes.position||L.morphAttributes.normal||L.morphAttributes.color,et=Q!==void 0?Q.length:0;let xt=0;L.morphAttributes.position!==void 0&&(xt=1),L.morphAttributes.normal!==void 0&&(xt=2),L.morphAttributes.color!==void 0&&(xt=3);let Nt,K,mt,wt;if(tt){const pt=Hn[tt];Nt=pt.vertexShader,K=pt.fragmentShader}else{Nt=v.vertexShader,K=v.fragmentShader;const pt=a.getVertexShaderStage(v),se=a.getFragmentShaderStage(v);a.update(v,pt,se),mt=pt.id,wt=se.id}const Ct=n.getRenderTarget(),gt=n.state.buffers.depth.getReversed(),Ft=U.isInstancedMesh===!0,Me=U.isBatchedMesh===!0,Pt=!!v.map,ie=!!v.matcap,oe=!!k,Gt=oe&&k.isPMREMTexture===!0,He=!!v.aoMap,Pe=!!v.lightMap,sn=!!v.bumpMap&&v.wireframe===!1,ve=!!v.normalMap,On=!!v.displacementMap,Fe=!!v.emissiveMap,mn=!!v.metalnessMap,gn=!!v.roughnessMap,vn=v.anisotropy>0,O=v.clearcoat>0,_n=v.diffuseRoughness>0,de=v.dispersion>0,pe=v.retroreflectivity>0,dt=v.iridescence>0,Le=v.sheen>0,Rt=v.transmission>0,Ut=vn&&!!v.anisotropyMap,A=O&&!!v.clearcoatMap,w=O&&!!v.clearcoatNormalMap,V=O&&!!v.clearcoatRoughnessMap,nt=_n&&!!v.diffuseRoughnessMap,J=dt&&!!v.iridescenceMap,rt=dt&&!!v.iridescenceThicknessMap,ht=Le&&!!v.sheenColorMap,Y=Le&&!!v.sheenRoughnessMap,Z=!!v.specularMap,at=!!v.specularColorMap,R=!!v.specularIntensityMap,j=Rt&&!!v.transmissionMap,q=Rt&&!!v.thicknessMap,lt=!!v.gradientMap,st=!!v.alphaMap,ot=v.alphaTest>0,Mt=!!v.alphaHash,Bt=!!v.extensions;let it=ci;v.toneMapped&&(Ct===null||Ct.isXRRenderTarget===!0)&&(it=n.toneMapping);const Tt=Gt?k.isCompressedCubeTexture?k.image[0].mipmaps:k.mipmaps:null,kt={shaderID:tt,shaderType:v.type,shaderName:v.name,vertexShader:Nt,fragmentShader:K,defines:v.defines,customVertexShaderID:mt,customFragmentShaderID:wt,isRawShaderMaterial:v.isRawShaderMaterial===!0,glslVersion:v.glslVersion,precision:W,batching:Me,batchingColor:Me&&U._colorsTexture!==null,instancing:Ft,instancingColor:Ft&&U.instanceColor!==null,instancingMorph:Ft&&U.morphTexture!==null,outputColorSpace:Ct===null?n.outputColorSpace:Ct.isXRRenderTarget===!0?Ct.texture.colorSpace:qt.workingColorSpace,alphaToCoverage:!!v.alphaToCoverage,map:Pt,matcap:ie,envMap:oe,envMapMode:oe&&k.mapping,envMapPMREM:Gt,envMapMaxLod:Gt?Tt.length-1:null,envMapSize:Gt?Tt[0].width:null,aoMap:He,lightMap:Pe,bumpMap:sn,normalMap:ve,displacementMap:On,emissiveMap:Fe,normalMapObjectSpace:ve&&v.normalMapType===k0,normalMapTangentSpace:ve&&v.normalMapType===gu,packedNormalMap:ve&&v.normalMapType===gu&&oy(v.normalMap.format),metalnessMap:mn,roughnessMap:gn,anisotropy:vn,anisotropyMap:Ut,clearcoat:O,clearcoatMap:A,clearcoatNormalMap:w,clearcoatRoughnessMap:V,diffuseRoughness:_n,diffuseRoughnessMap:nt,dispersion:de,retroreflection:pe,iridescence:dt,iridescenceMap:J,iridescenceThicknessMap:rt,sheen:Le,sheenColorMap:ht,sheenRoughnessMap:Y,specularMap:Z,specularColorMap:at,specularIntensityMap:R,transmission:Rt,transmissionMap:j,thicknessMap:q,gradientMap:lt,opaque:v.transparent===!1&&v.blending===Tr&&v.alphaToCoverage===!1,alphaMap:st,alphaTest:ot,alphaHash:Mt,combine:v.combine,mapUv:Pt&&p(v.map.channel),aoMapUv:He&&p(v.aoMap.channel),lightMapUv:Pe&&p(v.lightMap.channel),bumpMapUv:sn&&p(v.bumpMap.channel),normalMapUv:ve&&p(v.normalMap.channel),displacementMapUv:On&&p(v.displacementMap.channel),emissiveMapUv:Fe&&p(v.emissiveMap.channel),metalnessMapUv:mn&&p(v.metalnessMap.channel),roughnessMapUv:gn&&p(v.roughnessMap.channel),anisotropyMapUv:Ut&&p(v.anisotropyMap.channel),clearcoatMapUv:A&&p(v.clearcoatMap.channel),clearcoatNormalMapUv:w&&p(v.clearcoatNormalMap.channel),clearcoatRoughnessMapUv:V&&p(v.clearcoatRoughnessMap.channel),diffuseRoughnessMapUv:nt&&p(v.diffuseRoughnessMap.channel),iridescenceMapUv:J&&p(v.iridescenceMap.channel),iridescenceThicknessMapUv:rt&&p(v.iridescenceThicknessMap.channel),sheenColorMapUv:ht&&p(v.sheenColorMap.channel),sheenRoughnessMapUv:Y&&p(v.sheenRoughnessMap.channel),specularMapUv:Z&&p(v.specularMap.channel),specularColorMapUv:at&&p(v.specularColorMap.channel),specularIntensityMapUv:R&&p(v.specularIntensityMap.channel),transmissionMapUv:j&&p(v.transmissionMap.channel),thicknessMapUv:q&&p(v.thicknessMap.channel),alphaMapUv:st&&p(v.alphaMap.channel),vertexTangents:!!L.attributes.tangent&&(ve||vn),vertexNormals:!!L.attributes.normal,vertexColors:v.vertexColors,vertexAlphas:v.vertexColors===!0&&!!L.attributes.color&&L.attributes.color.itemSize===4,pointsUvs:U.isPoints===!0&&!!L.attributes.uv&&(Pt||st),fog:!!F,useFog:v.fog===!0,fogExp2:!!F&&F.isFogExp2,flatShading:v.wireframe===!1&&(v.flatShading===!0||L.attributes.normal===void 0&&ve===!1&&(v.isMeshLambertMaterial||v.isMeshPhongMaterial||v.isMeshStandardMaterial||v.isMeshPhysicalMaterial)),sizeAttenuation:v.sizeAttenuation===!0,logarithmicDepthBuffer:d,reversedDepthBuffer:gt,skinning:U.isSkinnedMesh===!0,hasPositionAttribute:L.attributes.position!==void 0,morphTargets:L.morphAttributes.position!==void 0,morphNormals:L.morphAttributes.normal!==void 0,morphColors:L.morphAttributes.color!==void 0,morphTargetsCount:et,morphTextureStride:xt,numSunLights:S.sun.length,numDirLights:S.directional.length,numPointLights:S.point.length,numSpotLights:S.spot.length,numSpotLightMaps:S.spotLightMap.length,numRectAreaLights:S.rectArea.length,numHemiLights:S.hemi.length,numSunLightShadows:S.sunShadowMap.length,numDirLightShadows:S.directionalShadowMap.length,numPointLightShadows:S.pointShadowMap.length,numSpotLightShadows:S.spotShadowMap.length,numSpotLightShadowsWithMaps:S.numSpotLightShadowsWithMaps,numLightProbes:S.numLightProbes,numLightProbeGrids:D.filter(pt=>pt.texture!==null).length,numClippingPlanes:r.numPlanes,numClipIntersection:r.numIntersection,dithering:v.dithering,shadowMapEnabled:n.shadowMap.enabled&&N.length>0,shadowMapType:n.shadowMap.type,toneMapping:it,decodeVideoTexture:Pt&&v.map.isVideoTexture===!0&&qt.getTransfer(v.map.colorSpace)===re,decodeVideoTextureEmissive:Fe&&v.emissiveMap.isVideoTexture===!0&&qt.getTransfer(v.emissiveMap.colorSpace)===re,premultipliedAlpha:v.premultipliedAlpha,doubleSided:v.side===Gn,flipSided:v.side===an,useDepthPacking:v.depthPacking>=0,depthPacking:v.depthPacking||0,index0AttributeName:v.index0AttributeName,extensionClipCullDistance:Bt&&v.extensions.clipCullDistance===!0&&e.has("WEBGL_clip_cull_distance"),extensionMultiDraw:(Bt&&v.extensions.multiDraw===!0||Me)&&e.has("WEBGL_multi_draw"),rendererExtensionParallelShaderCompile:e.has("KHR_parallel_shader_compile"),customProgramCacheKey:v.customProgramCacheKey()};return kt.vertexUv1s=l.has(1),kt.vertexUv2s=l.has(2),kt.vertexUv3s=l.has(3),l.clear(),kt}function x(v){const S=[];if(v.shaderID?S.push(v.shaderID):(S.push(v.customVertexShaderID),S.push(v.customFragmentShaderID)),v.defines!==void 0)for(const N in v.defines)S.push(N),S.push(v.defines[N]);return v.isRawShaderMaterial===!1&&(m(S,v),f(S,v),S.push(n.outputColorSpace)),S.push(v.customProgramCacheKey),S.join()}function m(v,S){v.push(S.precision),v.push(S.outputColorSpace),v.push(S.envMapMode),v.push(S.envMapPMREM),v.push(S.envMapMaxLod),v.push(S.envMapSize),v.push(S.mapUv),v.push(S.alphaMapUv),v.push(S.lightMapUv),v.push(S.aoMapUv),v.push(S.bumpMapUv),v.push(S.normalMapUv),v.push(S.displacementMapUv),v.push(S.emissiveMapUv),v.push(S.metalnessMapUv),v.push(S.roughnessMapUv),v.push(S.anisotropyMapUv),v.push(S.clearcoatMapUv),v.push(S.clearcoatNormalMapUv),v.push(S.clearcoatRoughnessMapUv),v.push(S.diffuseRoughnessMapUv),v.push(S.iridescenceMapUv),v.push(S.iridescenceThicknessMapUv),v.push(S.sheenColorMapUv),v.push(S.sheenRoughnessMapUv),v.push(S.specularMapUv),v.push(S.specularColorMapUv),v.push(S.specularIntensityMapUv),v.push(S.transmissionMapUv),v.push(S.thicknessMapUv),v.push(S.combine),v.push(S.fogExp2),v.push(S.sizeAttenuation),v.push(S.morphTargetsCount),v.push(S.numSunLights),v.push(S.numDirLights),v.push(S.numPointLights),v.push(S.numSpotLights),v.push(S.numSpotLightMaps),v.push(S.numHemiLights),v.push(S.numRectAreaLights),v.push(S.numSunLightShadows),v.push(S.numDirLightShadows),v.push(S.numPointLightShadows),v.push(S.numSpotLightShadows),v.push(S.numSpotLightShadowsWithMaps),v.push(S.numLightProbes),v.push(S.numLightProbeGrids),v.push(S.shadowMapType),v.push(S.toneMapping),v.push(S.numClippingPlanes),v.push(S.numClipIntersection),v.push(S.depthPacking)}function f(v,S){o.disableAll(),S.instancing&&o.enable(0),S.instancingColor&&o.enable(1),S.instancingMorph&&o.enable(2),S.matcap&&o.enable(3),S.envMap&&o.enable(4),S.normalMapObjectSpace&&o.enable(5),S.normalMapTangentSpace&&o.enable(6),S.clearcoat&&o.enable(7),S.iridescence&&o.enable(8),S.alphaTest&&o.enable(9),S.vertexColors&&o.enable(10),S.vertexAlphas&&o.enable(11),S.vertexUv1s&&o.enable(12),S.vertexUv2s&&o.enable(13),S.vertexUv3s&&o.enable(14),S.vertexTangents&&o.enable(15),S.anisotropy&&o.enable(16),S.alphaHash&&o.enable(17),S.batching&&o.enable(18),S.dispersion&&o.enable(19),S.retroreflection&&o.enable(24),S.diffuseRoughness&&o.enable(25),S.batchingColor&&o.enable(20),S.gradientMap&&o.enable(21),S.packedNormalMap&&o.enable(22),S.vertexNormals&&o.enable(23),v.push(o.mask),o.disableAll(),S.fog&&o.enable(0),S.useFog&&o.enable(1),S.flatShading&&o.enable(2),S.logarithmicDepthBuffer&&o.enable(3),S.reversedDepthBuffer&&o.enable(4),S.skinning&&o.enable(5),S.morphTargets&&o.enable(6),S.morphNormals&&o.enable(7),S.morphColors&&o.enable(8),S.premultipliedAlpha&&o.enable(9),S.shadowMapEnabled&&o.enable(10),S.doubleSided&&o.enable(11),S.flipSided&&o.enable(12),S.useDepthPacking&&o.enable(13),S.dithering&&o.enable(14),S.transmission&&o.enable(15),S.sheen&&o.enable(16),S.opaque&&o.enable(17),S.pointsUvs&&o.enable(18),S.decodeVideoTexture&&o.enable(19),S.decodeVideoTextureEmissive&&o.enable(20),S.alphaToCoverage&&o.enable(21),S.numLightProbeGrids>0&&o.enable(22),S.hasPositionAttribute&&o.enable(23),v.push(o.mask)}function _(v){const S=u[v.type];let N;if(S){const P=Hn[S];N=Nv.clone(P.uniforms)}else N=v.uniforms;return N}function M(v,S){let N=h.get(S);return N!==void 0?++N.usedTimes:(N=new ny(n,S,v,s),c.push(N),h.set(S,N)),N}function b(v){if(--v.usedTimes===0){const S=c.indexOf(v);c[S]=c[c.length-1],c.pop(),h.delete(v.cacheKey),v.destroy()}}function E(v){a.remove(v)}function T(){a.dispose()}return{getParameters:g,getProgramCacheKey:x,getUniforms:_,acquireProgram:M,releaseProgram:b,releaseShaderCache:E,programs:c,dispose:T}}function ly(){let n=new WeakMap;function t(o){return n.has(o)}function e(o){let a=n.get(o);return a===void 0&&(a={},n.set(o,a)),a}function i(o){n.delete(o)}function s(o,a,l){n.get(o)[a]=l}function r(){n=new WeakMap}return{has:t,get:e,remove:i,update:s,dispose:r}}function cy(n,t){return n.groupOrder!==t.groupOrder?n.groupOrder-t.groupOrder:n.renderOrder!==t.renderOrder?n.renderOrder-t.renderOrder:n.material.id!==t.material.id?n.material.id-t.material.id:n.materialVariant!==t.materialVariant?n.materialVariant-t.materialVariant:n.z!==t.z?n.z-t.z:n.id-t.id}function cd(n,t){return n.groupOrder!==t.groupOrder?n.groupOrder-t.groupOrder:n.renderOrder!==t.renderOrder?n.renderOrder-t.renderOrder:n.z!==t.z?t.z-n.z:n.id-t.id}function hd(){const n=[];let t=0;const e=[],i=[],s=[];function r(){t=0,e.length=0,i.length=0,s.length=0}function o(u){let p=0;return u.isInstancedMesh&&(p+=2),u.isSkinnedMesh&&(p+=1),p}function a(u,p,g,x,m,f){let _=n[t];return _===void 0?(_={id:u.id,object:u,geometry:p,material:g,materialVariant:o(u),groupOrder:x,renderOrder:u.renderOrder,z:m,group:f},n[t]=_):(_.id=u.id,_.object=u,_.geometry=p,_.material=g,_.materialVariant=o(u),_.groupOrder=x,_.renderOrder=u.renderOrder,_.z=m,_.group=f),t++,_}function l(u,p,g,x,m,f,_){_.reversedDepth===!0&&(m=-m);const M=a(u,p,g,x,m,f);g.transmission>0?i.push(M):g.transparent===!0?s.push(M):e.push(M)}function c(u,p,g,x,m,f){const _=a(u,p,g,x,m,f);g.transmission>0?i.unshift(_):g.transparent===!0?s.unshift(_):e.unshift(_)}function h(u,p){e.length>1&&e.sort(u||cy),i.length>1&&i.sort(p||cd),s.length>1&&s.sort(p||cd)}function d(){for(let u=t,p=n.length;u<p;u++){const g=n[u];if(g.id===null)break;g.id=null,g.object=null,g.geometry=null,g.material=null,g.group=null}}return{opaque:e,transmissive:i,transparent:s,init:r,push:l,unshift:c,finish:d,sort:h}}function hy(){let n=new WeakMap;function t(i,s){const r=n.get(i);let o;return r===void 0?(o=new hd,n.set(i,[o])):s>=r.length?(o=new hd,r.push(o)):o=r[s],o}function e(){n=new WeakMap}return{get:t,dispose:e}}function uy(){const n={};return{get:function(t){if(n[t.id]!==void 0)return n[t.id];let e;switch(t.type){case"SunLight":case"DirectionalLight":e={direction:new C,color:new Zt};break;case"SpotLight":e={position:new C,direction:new C,color:new Zt,distance:0,coneCos:0,penumbraCos:0,decay:0};break;case"PointLight":e={position:new C,color:new Zt,distance:0,decay:0};break;case"HemisphereLight":e={direction:new C,skyColor:new Zt,groundColor:new Zt};break;case"RectAreaLight":e={color:new Zt,position:new C,halfWidth:new C,halfHeight:new C};break}return n[t.id]=e,e}}}function dy(){const n={};return{get:function(t){if(n[t.id]!==void 0)return n[t.id];let e;switch(t.type){case"SunLight":case"DirectionalLight":e={shadowIntensity:1,shadowBias:0,shadowNormalBias:0,shadowRadius:1,shadowMapSize:new It};break;case"SpotLight":e={shadowIntensity:1,shadowBias:0,shadowNormalBias:0,shadowRadius:1,shadowMapSize:new It};break;case"PointLight":e={shadowIntensity:1,shadowBias:0,shadowNormalBias:0,shadowRadius:1,shadowMapSize:new It,shadowCameraNear:1,shadowCameraFar:1e3};break}return n[t.id]=e,e}}}let py=0;function fy(n,t){return(t.castShadow?2:0)-(n.castShadow?2:0)+(t.map?1:0)-(n.map?1:0)}function my(n){const t=new uy,e=dy(),i={version:0,hash:{sunLength:-1,directionalLength:-1,pointLength:-1,spotLength:-1,rectAreaLength:-1,hemiLength:-1,numSunShadows:-1,numDirectionalShadows:-1,numPointShadows:-1,numSpotShadows:-1,numSpotMaps:-1,numLightProbes:-1},ambient:[0,0,0],probe:[],sun:[],sunShadow:[],sunShadowMap:[],sunShadowMatrix:[],sunShadowCascade:[],directional:[],directionalShadow:[],directionalShadowMap:[],directionalShadowMatrix:[],spot:[],spotLightMap:[],spotShadow:[],spotShadowMap:[],spotLightMatrix:[],rectArea:[],rectAreaLTC1:null,rectAreaLTC2:null,point:[],pointShadow:[],pointShadowMap:[],pointShadowMatrix:[],hemi:[],numSpotLightShadowsWithMaps:0,numLightProbes:0};for(let c=0;c<9;c++)i.probe.push(new C);const s=new C,r=new Yt,o=new Yt;function a(c){let h=0,d=0,u=0;for(let D=0;D<9;D++)i.probe[D].set(0,0,0);let p=0,g=0,x=0,m=0,f=0,_=0,M=0,b=0,E=0,T=0,v=0,S=0,N=0,P=0;c.sort(fy);for(let D=0,F=c.length;D<F;D++){const L=c[D],z=L.color,$=L.intensity,k=L.distance;let tt=null;if(L.shadow&&L.shadow.map&&(L.shadow.map.texture.format===is?tt=L.shadow.map.texture:tt=L.shadow.map.depthTexture||L.shadow.map.texture),L.isAmbientLight)h+=z.r*$,d+=z.g*$,u+=z.b*$;else if(L.isLightProbe){for(let W=0;W<9;W++)i.probe[W].addScaledVector(L.sh.coefficients[W],$);P++}else if(L.isSunLight){const W=t.get(L);if(W.color.copy(L.color).multiplyScalar(L.intensity),L.castShadow){const Q=L.shadow,et=e.get(L);et.shadowIntensity=Q.intensity,et.shadowBias=Q.bias,et.shadowNormalBias=Q.normalBias,et.shadowRadius=Q.radius,et.shadowMapSize.copy(Q.mapSize).multiply(Q.getFrameExtents()),i.sunShadow[g]=et,i.sunShadowMap[g]=tt;const xt=Q.getViewportCount();for(let Nt=0;Nt<xt;Nt++)i.sunShadowMatrix[x+Nt]=Q.getMatrix(Nt),i.sunShadowCascade[x+Nt]=Q._cascadeData[Nt];x+=xt,g++}i.sun[p]=W,p++}else if(L.isDirectionalLight){const W=t.get(L);if(W.color.copy(L.color).multiplyScalar(L.intensity),L.castShadow){const Q=L.shadow,et=e.get(L);et.shadowIntensity=Q.intensity,et.shadowBias=Q.bias,et.shadowNormalBias=Q.normalBias,et.shadowRadius=Q.radius,et.shadowMapSize=Q.mapSize,i.directionalShadow[m]=et,i.directionalShadowMap[m]=tt,i.directionalShadowMatrix[m]=L.shadow.matrix,E++}i.directional[m]=W,m++}else if(L.isSpotLight){const W=t.get(L);W.position.setFromMatrixPosition(L.matrixWorld),W.color.copy(z).multiplyScalar($),W.distance=k,W.coneCos=Math.cos(L.angle),W.penumbraCos=Math.cos(L.angle*(1-L.penumbra)),W.decay=L.decay,i.spot[_]=W;const Q=L.shadow;if(L.map&&(i.spotLightMap[S]=L.map,S++,Q.updateMatrices(L),L.castShadow&&N++),i.spotLightMatrix[_]=Q.matrix,L.castShadow){const et=e.get(L);et.shadowIntensity=Q.intensity,et.shadowBias=Q.bias,et.shadowNormalBias=Q.normalBias,et.shadowRadius=Q.radius,et.shadowMapSize=Q.mapSize,i.spotShadow[_]=et,i.spotShadowMap[_]=tt,v++}_++}else if(L.isRectAreaLight){const W=t.get(L);W.color.copy(z).multiplyScalar($),W.halfWidth.set(L.width*.5,0,0),W.halfHeight.set(0,L.height*.5,0),i.rectArea[M]=W,M++}else if(L.isPointLight){const W=t.get(L);if(W.color.copy(L.color).multiplyScalar(L.intensity),W.distance=L.distance,W.decay=L.decay,L.castShadow){const Q=L.shadow,et=e.get(L);et.shadowIntensity=Q.intensity,et.shadowBias=Q.bias,et.shadowNormalBias=Q.normalBias,et.shadowRadius=Q.radius,et.shadowMapSize=Q.mapSize,et.shadowCameraNear=Q.camera.near,et.shadowCameraFar=Q.camera.far,i.pointShadow[f]=et,i.pointShadowMap[f]=tt,i.pointShadowMatrix[f]=L.shadow.matrix,T++}i.point[f]=W,f++}else if(L.isHemisphereLight){const W=t.get(L);W.skyColor.copy(L.color).multiplyScalar($),W.groundColor.copy(L.groundColor).multiplyScalar($),i.hemi[b]=W,b++}}M>0&&(n.has("OES_texture_float_linear")===!0?(i.rectAreaLTC1=ft.LTC_FLOAT_1,i.rectAreaLTC2=ft.LTC_FLOAT_2):(i.rectAreaLTC1=ft.LTC_HALF_1,i.rectAreaLTC2=ft.LTC_HALF_2)),i.ambient[0]=h,i.ambient[1]=d,i.ambient[2]=u;const U=i.hash;(U.sunLength!==p||U.directionalLength!==m||U.pointLength!==f||U.spotLength!==_||U.rectAreaLength!==M||U.hemiLength!==b||U.numSunShadows!==g||U.numDirectionalShadows!==E||U.numPointShadows!==T||U.numSpotShadows!==v||U.numSpotMaps!==S||U.numLightProbes!==P)&&(i.sun.length=p,i.directional.length=m,i.spot.length=_,i.rectArea.length=M,i.point.length=f,i.hemi.length=b,i.sunShadow.length=g,i.sunShadowMap.length=g,i.sunShadowMatrix.length=x,i.sunShadowCascade.length=x,i.directionalShadow.length=E,i.directionalShadowMap.length=E,i.directionalShadowMatrix.length=E,i.pointShadow.length=T,i.pointShadowMap.length=T,i.pointShadowMatrix.length=T,i.spotShadow.length=v,i.spotShadowMap.length=v,i.spotLightMatrix.length=v+S-N,i.spotLightMap.length=S,i.numSpotLightShadowsWithMaps=N,i.numLightProbes=P,U.sunLength=p,U.directionalLength=m,U.pointLength=f,U.spotLength=_,U.rectAreaLength=M,U.hemiLength=b,U.numSunShadows=g,U.numDirectionalShadows=E,U.numPointShadows=T,U.numSpotShadows=v,U.numSpotMaps=S,U.numLightProbes=P,i.version=py++)}function l(c,h){let d=0,u=0,p=0,g=0,x=0,m=0;const f=h.matrixWorldInverse;for(let _=0,M=c.length;_<M;_++){const b=c[_];if(b.isSunLight){const E=i.sun[d];E.direction.setFromMatrixPosition(b.matrixWorld),E.direction.transformDirection(f),d++}else if(b.isDirectionalLight){const E=i.directional[u];E.direction.setFromMatrixPosition(b.matrixWorld),s.setFromMatrixPosition(b.target.matrixWorld),E.direction.sub(s),E.direction.transformDirection(f),u++}else if(b.isSpotLight){const E=i.spot[g];E.position.setFromMatrixPosition(b.matrixWorld),E.position.applyMatrix4(f),E.direction.setFromMatrixPosition(b.matrixWorld),s.setFromMatrixPosition(b.target.matrixWorld),E.direction.sub(s),E.direction.transformDirection(f),g++}else if(b.isRectAreaLight){const E=i.rectArea[x];E.position.setFromMatrixPosition(b.matrixWorld),E.position.applyMatrix4(f),o.identity(),r.copy(b.matrixWorld),r.premultiply(f),o.extractRotation(r),E.halfWidth.set(b.width*.5,0,0),E.halfHeight.set(0,b.height*.5,0),E.halfWidth.applyMatrix4(o),E.halfHeight.applyMatrix4(o),x++}else if(b.isPointLight){const E=i.point[p];E.position.setFromMatrixPosition(b.matrixWorld),E.position.applyMatrix4(f),p++}else if(b.isHemisphereLight){const E=i.hemi[m];E.direction.setFromMatrixPosition(b.matrixWorld),E.direction.transformDirection(f),m++}}}return{setup:a,setupView:l,state:i}}function ud(n){const t=new my(n),e=[],i=[],s=[];function r(d){h.camera=d,e.length=0,i.length=0,s.length=0}function o(d){d.isLightProbeGrid?s.push(d):e.push(d)}function a(d){i.push(d)}function l(){t.setup(e),s.sort((d,u)=>d.priority-u.priority||d.id-u.id)}function c(d){t.setupView(e,d)}const h={lightsArray:e,shadowsArray:i,lightProbeGridArray:s,camera:null,lights:t,transmissionRenderTarget:{},textureUnits:0};return{init:r,state:h,setupLights:l,setupLightsView:c,pushLight:o,pushShadow:a}}function gy(n){let t=new WeakMap;function e(s,r=0){const o=t.get(s);let a;return o===void 0?(a=new ud(n),t.set(s,[a])):r>=o.length?(a=new ud(n),o.push(a)):a=o[r],a}function i(){t=new WeakMap}return{get:e,dispose:i}}const vy=`void main() {
	gl_Position = vec4( position, 1.0 );
}`,_y=`uniform sampler2D shadow_pass;
uniform vec2 resolution;
uniform float radius;
void main() {
	const float samples = float( VSM_SAMPLES );
	float mean = 0.0;
	float squared_mean = 0.0;
	float uvStride = samples <= 1.0 ? 0.0 : 2.0 / ( samples - 1.0 );
	float uvStart = samples <= 1.0 ? 0.0 : - 1.0;
	for ( float i = 0.0; i < samples; i ++ ) {
		float uvOffset = uvStart + i * uvStride;
		#ifdef HORIZONTAL_PASS
			vec2 distribution = texture2D( shadow_pass, ( gl_FragCoord.xy + vec2( uvOffset, 0.0 ) * radius ) / resolution ).rg;
			mean += distribution.x;
			squared_mean += distribution.y * distribution.y + distribution.x * distribution.x;
		#else
			float depth = texture2D( shadow_pass, ( gl_FragCoord.xy + vec2( 0.0, uvOffset ) * radius ) / resolution ).r;
			mean += depth;
			squared_mean += depth * depth;
		#endif
	}
	mean = mean / samples;
	squared_mean = squared_mean / samples;
	float std_dev = sqrt( max( 0.0, squared_mean - mean * mean ) );
	gl_FragColor = vec4( mean, std_dev, 0.0, 1.0 );
}`,xy=[new C(1,0,0),new C(-1,0,0),new C(0,1,0),new C(0,-1,0),new C(0,0,1),new C(0,0,-1)],by=[new C(0,-1,0),new C(0,-1,0),new C(0,0,1),new C(0,0,-1),new C(0,-1,0),new C(0,-1,0)],dd=new Yt,ur=new C,ml=new C;function wy(n,t,e){let i=new da;const s=new It,r=new It,o=new Ee,a=new kv,l=new Bv,c={},h=e.maxTextureSize,d={[ns]:an,[an]:ns,[Gn]:Gn},u=new dn({defines:{VSM_SAMPLES:8},uniforms:{shadow_pass:{value:null},resolution:{value:new It},radius:{value:4}},vertexShader:vy,fragmentShader:_y}),p=u.clone();p.defines.HORIZONTAL_PASS=1;const g=new Ve;g.setAttribute("position",new un(new Float32Array([-1,-1,.5,3,-1,.5,-1,3,.5]),3));const x=new _t(g,u),m=this;this.enabled=!1,this.autoUpdate=!0,this.needsUpdate=!1,this.type=$o;let f=this.type;this.render=function(T,v,S){if(m.enabled===!1||m.autoUpdate===!1&&m.needsUpdate===!1||T.length===0)return;this.type===_0&&(Dt("WebGLShadowMap: PCFSoftShadowMap has been removed. Using PCFShadowMap instead."),this.type=$o);const N=n.getRenderTarget(),P=n.getActiveCubeFace(),U=n.getActiveMipmapLevel(),D=n.state;D.setBlending(Ns),D.buffers.depth.getReversed()===!0?D.buffers.color.setClear(0,0,0,0):D.buffers.color.setClear(1,1,1,1),D.buffers.depth.setTest(!0),D.setScissorTest(!1);const F=f!==this.type;F&&v.traverse(function(L){L.material&&(Array.isArray(L.material)?L.material.forEach(z=>z.needsUpdate=!0):L.material.needsUpdate=!0)});for(let L=0,z=T.length;L<z;L++){const $=T[L],k=$.shadow;if(k===void 0){Dt("WebGLShadowMap:",$,"has no shadow.");continue}if(k.autoUpdate===!1&&k.needsUpdate===!1)continue;s.copy(k.mapSize);const tt=k.getFrameExtents();s.multiply(tt),r.copy(k.mapSize),(s.x>h||s.y>h)&&(s.x>h&&(r.x=Math.floor(h/tt.x),s.x=r.x*tt.x,k.mapSize.x=r.x),s.y>h&&(r.y=Math.floor(h/tt.y),s.y=r.y*tt.y,k.mapSize.y=r.y));const W=n.state.buffers.depth.getReversed();if(k.camera._reversedDepth=W,k.map===null||F===!0){if(k.map!==null&&(k.map.depthTexture!==null&&(k.map.depthTexture.dispose(),k.map.depthTexture=null),k.map.dispose()),this.type===_r){if($.isPointLight){Dt("WebGLShadowMap: VSM shadow maps are not supported for PointLights. Use PCF or BasicShadowMap instead.");continue}k.map=new En(s.x,s.y,{format:is,type:Yn,minFilter:tn,magFilter:tn,generateMipmaps:!1}),k.map.texture.name=$.name+".shadowMap",k.map.depthTexture=new Xs(s.x,s.y,Nn),k.map.depthTexture.name=$.name+".shadowMapDepth",k.map.depthTexture.format=Bi,k.map.depthTexture.compareFunction=null,k.map.depthTexture.minFilter=Se,k.map.depthTexture.magFilter=Se}else $.isPointLight?(k.map=new ah(s.x),k.map.depthTexture=new Sf(s.x,$n)):(k.map=new En(s.x,s.y),k.map.depthTexture=new Xs(s.x,s.y,$n)),k.map.depthTexture.name=$.name+".shadowMap",k.map.depthTexture.format=Bi,this.type===$o?(k.map.depthTexture.compareFunction=W?lf:af,k.map.depthTexture.minFilter=tn,k.map.depthTexture.magFilter=tn):(k.map.depthTexture.compareFunction=null,k.map.depthTexture.minFilter=Se,k.map.depthTexture.magFilter=Se);k.camera.updateProjectionMatrix()}k.map.isWebGLCubeRenderTarget!==!0&&(k.map.width!==s.x||k.map.height!==s.y)&&k.map.setSize(s.x,s.y);const Q=k.map.isWebGLCubeRenderTarget?6:k.getViewportCount();$.isPointLight!==!0&&k.updateMatrices($,S);const et=(k.camera.layers.mask&4294967294)!==0?k.camera.layers:S.layers;for(let xt=0;xt<Q;xt++){const Nt=k.getCamera(xt);if($.isPointLight){const K=k.camera,mt=k.matrix,wt=$.distance||K.far;wt!==K.far&&(K.far=wt,K.updateProjectionMatrix()),ur.setFromMatrixPosition($.matrixWorld),K.position.copy(ur),ml.copy(K.position),ml.add(xy[xt]),K.up.copy(by[xt]),K.lookAt(ml),K.updateMatrixWorld(),mt.makeTranslation(-ur.x,-ur.y,-ur.z),dd.multiplyMatrices(K.projectionMatrix,K.matrixWorldInverse),k._frustum.setFromProjectionMatrix(dd,K.coordinateSystem,K.reversedDepth)}if(k.map.isWebGLCubeRenderTarget)n.setRenderTarget(k.map,xt),n.clear();else{xt===0&&(n.setRenderTarget(k.map),n.clear());const K=k.getViewport(xt);o.set(r.x*K.x,r.y*K.y,r.x*K.z,r.y*K.w),D.viewport(o)}i=k.getFrustum(xt),b(v,S,Nt,$,et,this.type)}k.isPointLightShadow!==!0&&this.type===_r&&_(k,S),k.needsUpdate=!1}f=this.type,m.needsUpdate=!1,n.setRenderTarget(N,P,U)};function _(T,v){const S=t.update(x);u.defines.VSM_SAMPLES!==T.blurSamples&&(u.defines.VSM_SAMPLES=T.blurSamples,p.defines.VSM_SAMPLES=T.blurSamples,u.needsUpdate=!0,p.needsUpdate=!0),T.mapPass===null?T.mapPass=new En(s.x,s.y,{format:is,type:Yn}):(T.mapPass.width!==T.map.width||T.mapPass.height!==T.map.height)&&T.mapPass.setSize(T.map.width,T.map.height),u.uniforms.shadow_pass.value=T.map.depthTexture,u.uniforms.resolution.value.set(T.map.width,T.map.height),u.uniforms.radius.value=T.radius,n.setRenderTarget(T.mapPass),n.clear(),n.renderBufferDirect(v,null,S,u,x,null),p.uniforms.shadow_pass.value=T.mapPass.texture,p.uniforms.resolution.value.set(T.map.width,T.map.height),p.uniforms.radius.value=T.radius,n.setRenderTarget(T.map),n.clear(),n.renderBufferDirect(v,null,S,p,x,null)}function M(T,v,S,N){let P=null;const U=S.isPointLight===!0?T.customDistanceMaterial:T.customDepthMaterial;if(U!==void 0)P=U;else if(P=S.isPointLight===!0?l:a,n.localClippingEnabled&&v.clipShadows===!0&&Array.isArray(v.clippingPlanes)&&v.clippingPlanes.length!==0||v.displacementMap&&v.displacementScale!==0||v.alphaMap&&v.alphaTest>0||v.map&&v.alphaTest>0||v.alphaToCoverage===!0){const D=P.uuid,F=v.uuid;let L=c[D];L===void 0&&(L={},c[D]=L);let z=L[F];z===void 0&&(z=P.clone(),L[F]=z,v.addEventListener("dispose",E)),P=z}if(P.visible=v.visible,P.wireframe=v.wireframe,N===_r?P.side=v.shadowSide!==null?v.shadowSide:v.side:P.side=v.shadowSide!==null?v.shadowSide:d[v.side],P.alphaMap=v.alphaMap,P.alphaTest=v.alphaToCoverage===!0?.5:v.alphaTest,P.map=v.map,P.clipShadows=v.clipShadows,P.clippingPlanes=v.clippingPlanes,P.clipIntersection=v.clipIntersection,P.displacementMap=v.displacementMap,P.displacementScale=v.displacementScale,P.displacementBias=v.displacementBias,P.wireframeLinewidth=v.wireframeLinewidth,P.linewidth=v.linewidth,S.isPointLight===!0&&P.isMeshDistanceMaterial===!0){const D=n.properties.get(P);D.light=S}return P}function b(T,v,S,N,P,U){if(T.visible===!1)return;if(T.layers.test(P)&&(T.isMesh||T.isLine||T.isPoints)&&(T.castShadow||T.receiveShadow&&U===_r)&&(!T.frustumCulled||T.intersectsFrustum(i))){T.modelViewMatrix.multiplyMatrices(S.matrixWorldInverse,T.matrixWorld);const L=t.update(T),z=T.material;if(Array.isArray(z)){const $=L.groups;for(let k=0,tt=$.length;k<tt;k++){const W=$[k],Q=z[W.materialIndex];if(Q&&Q.visible){const et=M(T,Q,N,U);T.onBeforeShadow(n,T,v,S,L,et,W),n.renderBufferDirect(S,null,L,et,T,W),T.onAfterShadow(n,T,v,S,L,et,W)}}}else if(z.visible){const $=M(T,z,N,U);T.onBeforeShadow(n,T,v,S,L,$,null),n.renderBufferDirect(S,null,L,$,T,null),T.onAfterShadow(n,T,v,S,L,$,null)}}const F=T.children;for(let L=0,z=F.length;L<z;L++)b(F[L],v,S,N,P,U)}function E(T){T.target.removeEventListener("dispose",E);for(const S in c){const N=c[S],P=T.target.uuid;P in N&&(N[P].dispose(),delete N[P])}}}function yy(n,t){function e(){let R=!1;const j=new Ee;let q=null;const lt=new Ee(0,0,0,0);return{setMask:function(st){q!==st&&!R&&(n.colorMask(st,st,st,st),q=st)},setLocked:function(st){R=st},setClear:function(st,ot,Mt,Bt,it){it===!0&&(st*=Bt,ot*=Bt,Mt*=Bt),j.set(st,ot,Mt,Bt),lt.equals(j)===!1&&(n.clearColor(st,ot,Mt,Bt),lt.copy(j))},reset:function(){R=!1,q=null,lt.set(-1,0,0,0)}}}function i(){let R=!1,j=!1,q=null,lt=null,st=null;return{setReversed:function(ot){if(j!==ot){const Mt=t.get("EXT_clip_control");ot?Mt.clipControlEXT(Mt.LOWER_LEFT_EXT,Mt.ZERO_TO_ONE_EXT):Mt.clipControlEXT(Mt.LOWER_LEFT_EXT,Mt.NEGATIVE_ONE_TO_ONE_EXT),j=ot;const Bt=st;st=null,this.setClear(Bt)}},getReversed:function(){return j},setTest:function(ot){ot?gt(n.DEPTH_TEST):Ft(n.DEPTH_TEST)},setMask:function(ot){q!==ot&&!R&&(n.depthMask(ot),q=ot)},setFunc:function(ot){if(j&&(ot=K0[ot]),lt!==ot){switch(ot){case Bl:n.depthFunc(n.NEVER);break;case zl:n.depthFunc(n.ALWAYS);break;case Vl:n.depthFunc(n.LESS);break;case Pr:n.depthFunc(n.LEQUAL);break;case Hl:n.depthFunc(n.EQUAL);break;case Gl:n.depthFunc(n.GEQUAL);break;case Wl:n.depthFunc(n.GREATER);break;case Xl:n.depthFunc(n.NOTEQUAL);break;default:n.depthFunc(n.LEQUAL)}lt=ot}},setLocked:function(ot){R=ot},setClear:function(ot){st!==ot&&(st=ot,j&&(ot=1-ot),n.clearDepth(ot))},reset:function(){R=!1,q=null,lt=null,st=null,j=!1}}}function s(){let R=!1,j=null,q=null,lt=null,st=null,ot=null,Mt=null,Bt=null,it=null;return{setTest:function(Tt){R||(Tt?gt(n.STENCIL_TEST):Ft(n.STENCIL_TEST))},setMask:function(Tt){j!==Tt&&!R&&(n.stencilMask(Tt),j=Tt)},setFunc:function(Tt,kt,pt){(q!==Tt||lt!==kt||st!==pt)&&(n.stencilFunc(Tt,kt,pt),q=Tt,lt=kt,st=pt)},setOp:function(Tt,kt,pt){(ot!==Tt||Mt!==kt||Bt!==pt)&&(n.stencilOp(Tt,kt,pt),ot=Tt,Mt=kt,Bt=pt)},setLocked:function(Tt){R=Tt},setClear:function(Tt){it!==Tt&&(n.clearStencil(Tt),it=Tt)},reset:function(){R=!1,j=null,q=null,lt=null,st=null,ot=null,Mt=null,Bt=null,it=null}}}const r=new e,o=new i,a=new s;let l={};const c=new WeakMap;let h={},d={},u={},p=new WeakMap,g=[],x=null,m=!1,f=null,_=null,M=null,b=null,E=null,T=null,v=null,S=new Zt(0,0,0),N=0,P=!1,U=null,D=null,F=null,L=null,z=null;const $=n.getParameter(n.MAX_COMBINED_TEXTURE_IMAGE_UNITS);let k=!1,tt=0;const W=n.getParameter(n.VERSION);W.indexOf("WebGL")!==-1?(tt=parseFloat(/^WebGL (\d)/.exec(W)[1]),k=tt>=1):W.indexOf("OpenGL ES")!==-1&&(tt=parseFloat(/^OpenGL ES (\d)/.exec(W)[1]),k=tt>=2);let Q=null,et={};const xt=n.getParameter(n.SCISSOR_BOX),Nt=n.getParameter(n.VIEWPORT),K=new Ee().fromArray(xt),mt=new Ee().fromArray(Nt);function wt(R,j,q,lt){const st=new Uint8Array(4),ot=n.createTexture();n.bindTexture(R,ot),n.texParameteri(R,n.TEXTURE_MIN_FILTER,n.NEAREST),n.texParameteri(R,n.TEXTURE_MAG_FILTER,n.NEAREST);for(let Mt=0;Mt<q;Mt++)R===n.TEXTURE_3D||R===n.TEXTURE_2D_ARRAY?n.texImage3D(j,0,n.RGBA,1,1,lt,0,n.RGBA,n.UNSIGNED_BYTE,st):n.texImage2D(j+Mt,0,n.RGBA,1,1,0,n.RGBA,n.UNSIGNED_BYTE,st);return ot}const Ct={};Ct[n.TEXTURE_2D]=wt(n.TEXTURE_2D,n.TEXTURE_2D,1),Ct[n.TEXTURE_CUBE_MAP]=wt(n.TEXTURE_CUBE_MAP,n.TEXTURE_CUBE_MAP_POSITIVE_X,6),Ct[n.TEXTURE_2D_ARRAY]=wt(n.TEXTURE_2D_ARRAY,n.TEXTURE_2D_ARRAY,1,1),Ct[n.TEXTURE_3D]=wt(n.TEXTURE_3D,n.TEXTURE_3D,1,1),r.setClear(0,0,0,1),o.setClear(1),a.setClear(0),gt(n.DEPTH_TEST),o.setFunc(Pr),sn(!1),ve(du),gt(n.CULL_FACE),He(Ns);function gt(R){h[R]!==!0&&(n.enable(R),h[R]=!0)}function Ft(R){h[R]!==!1&&(n.disable(R),h[R]=!1)}function Me(R,j){return u[R]!==j?(n.bindFramebuffer(R,j),u[R]=j,R===n.DRAW_FRAMEBUFFER&&(u[n.FRAMEBUFFER]=j),R===n.FRAMEBUFFER&&(u[n.DRAW_FRAMEBUFFER]=j),!0):!1}function Pt(R,j){let q=g,lt=!1;if(R){q=p.get(j),q===void 0&&(q=[],p.set(j,q));const st=R.textures;if(q.length!==st.length||q[0]!==n.COLOR_ATTACHMENT0){for(let ot=0,Mt=st.length;ot<Mt;ot++)q[ot]=n.COLOR_ATTACHMENT0+ot;q.length=st.length,lt=!0}}else q[0]!==n.BACK&&(q[0]=n.BACK,lt=!0);lt&&n.drawBuffers(q)}function ie(R){return x!==R?(n.useProgram(R),x=R,!0):!1}const oe={[Rs]:n.FUNC_ADD,[x0]:n.FUNC_SUBTRACT,[b0]:n.FUNC_REVERSE_SUBTRACT};oe[w0]=n.MIN,oe[Hp]=n.MAX;const Gt={[y0]:n.ZERO,[kl]:n.ONE,[S0]:n.SRC_COLOR,[Gp]:n.SRC_ALPHA,[R0]:n.SRC_ALPHA_SATURATE,[A0]:n.DST_COLOR,[M0]:n.DST_ALPHA,[E0]:n.ONE_MINUS_SRC_COLOR,[Wp]:n.ONE_MINUS_SRC_ALPHA,[C0]:n.ONE_MINUS_DST_COLOR,[T0]:n.ONE_MINUS_DST_ALPHA,[P0]:n.CONSTANT_COLOR,[L0]:n.ONE_MINUS_CONSTANT_COLOR,[D0]:n.CONSTANT_ALPHA,[I0]:n.ONE_MINUS_CONSTANT_ALPHA};function He(R,j,q,lt,st,ot,Mt,Bt,it,Tt){if(R===Ns){m===!0&&(Ft(n.BLEND),m=!1);return}if(m===!1&&(gt(n.BLEND),m=!0),R!==Vp){if(R!==f||Tt!==P){if((_!==Rs||E!==Rs)&&(n.blendEquation(n.FUNC_ADD),_=Rs,E=Rs),Tt)switch(R){case Tr:n.blendFuncSeparate(n.ONE,n.ONE_MINUS_SRC_ALPHA,n.ONE,n.ONE_MINUS_SRC_ALPHA);break;case pu:n.blendFunc(n.ONE,n.ONE);break;case fu:n.blendFuncSeparate(n.ZERO,n.ONE_MINUS_SRC_COLOR,n.ZERO,n.ONE);break;case mu:n.blendFuncSeparate(n.DST_COLOR,n.ONE_MINUS_SRC_ALPHA,n.ZERO,n.ONE);break;default:Qt("WebGLState: Invalid blending: ",R);break}else switch(R){case Tr:n.blendFuncSeparate(n.SRC_ALPHA,n.ONE_MINUS_SRC_ALPHA,n.ONE,n.ONE_MINUS_SRC_ALPHA);break;case pu:n.blendFuncSeparate(n.SRC_ALPHA,n.ONE,n.ONE,n.ONE);break;case fu:Qt("WebGLState: SubtractiveBlending requires material.premultipliedAlpha = true");break;case mu:Qt("WebGLState: MultiplyBlending requires material.premultipliedAlpha = true");break;default:Qt("WebGLState: Invalid blending: ",R);break}M=null,b=null,T=null,v=null,S.set(0,0,0),N=0,f=R,P=Tt}return}st=st||j,ot=ot||q,Mt=Mt||lt,(j!==_||st!==E)&&(n.blendEquationSeparate(oe[j],oe[st]),_=j,E=st),(q!==M||lt!==b||ot!==T||Mt!==v)&&(n.blendFuncSeparate(Gt[q],Gt[lt],Gt[ot],Gt[Mt]),M=q,b=lt,T=ot,v=Mt),(Bt.equals(S)===!1||it!==N)&&(n.blendColor(Bt.r,Bt.g,Bt.b,it),S.copy(Bt),N=it),f=R,P=!1}function Pe(R,j){R.side===Gn?Ft(n.CULL_FACE):gt(n.CULL_FACE);let q=R.side===an;j&&(q=!q),sn(q),R.blending===Tr&&R.transparent===!1?He(Ns):He(R.blending,R.blendEquation,R.blendSrc,R.blendDst,R.blendEquationAlpha,R.blendSrcAlpha,R.blendDstAlpha,R.blendColor,R.blendAlpha,R.premultipliedAlpha),o.setFunc(R.depthFunc),o.setTest(R.depthTest),o.setMask(R.depthWrite),r.setMask(R.colorWrite);const lt=R.stencilWrite;a.setTest(lt),lt&&(a.setMask(R.stencilWriteMask),a.setFunc(R.stencilFunc,R.stencilRef,R.stencilFuncMask),a.setOp(R.stencilFail,R.stencilZFail,R.stencilZPass)),Fe(R.polygonOffset,R.polygonOffsetFactor,R.polygonOffsetUnits),R.alphaToCoverage===!0?gt(n.SAMPLE_ALPHA_TO_COVERAGE):Ft(n.SAMPLE_ALPHA_TO_COVERAGE)}function sn(R){U!==R&&(R?n.frontFace(n.CW):n.frontFace(n.CCW),U=R)}function ve(R){R!==g0?(gt(n.CULL_FACE),R!==D&&(R===du?n.cullFace(n.BACK):R===v0?n.cullFace(n.FRONT):n.cullFace(n.FRONT_AND_BACK))):Ft(n.CULL_FACE),D=R}function On(R){R!==F&&(k&&n.lineWidth(R),F=R)}function Fe(R,j,q){R?(gt(n.POLYGON_OFFSET_FILL),(L!==j||z!==q)&&(L=j,z=q,o.getReversed()&&(j=-j,q=-q),n.polygonOffset(j,q))):Ft(n.POLYGON_OFFSET_FILL)}function mn(R){R?gt(n.SCISSOR_TEST):Ft(n.SCISSOR_TEST)}function gn(R){R===void 0&&(R=n.TEXTURE0+$-1),Q!==R&&(n.activeTexture(R),Q=R)}function vn(R,j,q){q===void 0&&(Q===null?q=n.TEXTURE0+$-1:q=Q);let lt=et[q];lt===void 0&&(lt={type:void 0,texture:void 0},et[q]=lt),(lt.type!==R||lt.texture!==j)&&(Q!==q&&(n.activeTexture(q),Q=q),n.bindTexture(R,j||Ct[R]),lt.type=R,lt.texture=j)}function O(){const R=et[Q];R!==void 0&&R.type!==void 0&&(n.bindTexture(R.type,null),R.type=void 0,R.texture=void 0)}function _n(){try{n.compressedTexImage2D(...arguments)}catch(R){Qt("WebGLState:",R)}}function de(){try{n.compressedTexImage3D(...arguments)}catch(R){Qt("WebGLState:",R)}}function pe(){try{n.texSubImage2D(...arguments)}catch(R){Qt("WebGLState:",R)}}function dt(){try{n.texSubImage3D(...arguments)}catch(R){Qt("WebGLState:",R)}}function Le(){try{n.compressedTexSubImage2D(...arguments)}catch(R){Qt("WebGLState:",R)}}function Rt(){try{n.compressedTexSubImage3D(...arguments)}catch(R){Qt("WebGLState:",R)}}function Ut(){try{n.texStorage2D(...arguments)}catch(R){Qt("WebGLState:",R)}}function A(){try{n.texStorage3D(...arguments)}catch(R){Qt("WebGLState:",R)}}function w(){try{n.texImage2D(...arguments)}catch(R){Qt("WebGLState:",R)}}function V(){try{n.texImage3D(...arguments)}catch(R){Qt("WebGLState:",R)}}function nt(R){return d[R]!==void 0?d[R]:n.getParameter(R)}function J(R,j){d[R]!==j&&(n.pixelStorei(R,j),d[R]=j)}function rt(R){K.equals(R)===!1&&(n.scissor(R.x,R.y,R.z,R.w),K.copy(R))}function ht(R){mt.equals(R)===!1&&(n.viewport(R.x,R.y,R.z,R.w),mt.copy(R))}function Y(R,j){let q=c.get(j);q===void 0&&(q=new WeakMap,c.set(j,q));let lt=q.get(R);lt===void 0&&(lt=n.getUniformBlockIndex(j,R.name),n.uniformBlockBinding(j,lt,lt),q.set(R,lt))}function Z(R,j,q){const st=c.get(j).get(R);l[st]!==q&&(n.bindBufferBase(n.UNIFORM_BUFFER,st,q),l[st]=q)}function at(){n.disable(n.BLEND),n.disable(n.CULL_FACE),n.disable(n.DEPTH_TEST),n.disable(n.POLYGON_OFFSET_FILL),n.disable(n.SCISSOR_TEST),n.disable(n.STENCIL_TEST),n.disable(n.SAMPLE_ALPHA_TO_COVERAGE),n.blendEquation(n.FUNC_ADD),n.blendFunc(n.ONE,n.ZERO),n.blendFuncSeparate(n.ONE,n.ZERO,n.ONE,n.ZERO),n.blendColor(0,0,0,0),n.colorMask(!0,!0,!0,!0),n.clearColor(0,0,0,0),n.depthMask(!0),n.depthFunc(n.LESS),o.setReversed(!1),n.clearDepth(1),n.stencilMask(4294967295),n.stencilFunc(n.ALWAYS,0,4294967295),n.stencilOp(n.KEEP,n.KEEP,n.KEEP),n.clearStencil(0),n.cullFace(n.BACK),n.frontFace(n.CCW),n.polygonOffset(0,0),n.activeTexture(n.TEXTURE0),n.bindFramebuffer(n.FRAMEBUFFER,null),n.bindFramebuffer(n.DRAW_FRAMEBUFFER,null),n.bindFramebuffer(n.READ_FRAMEBUFFER,null),n.useProgram(null),n.lineWidth(1),n.scissor(0,0,n.canvas.width,n.canvas.height),n.viewport(0,0,n.canvas.width,n.canvas.height),n.pixelStorei(n.PACK_ALIGNMENT,4),n.pixelStorei(n.UNPACK_ALIGNMENT,4),n.pixelStorei(n.UNPACK_FLIP_Y_WEBGL,!1),n.pixelStorei(n.UNPACK_PREMULTIPLY_ALPHA_WEBGL,!1),n.pixelStorei(n.UNPACK_COLORSPACE_CONVERSION_WEBGL,n.BROWSER_DEFAULT_WEBGL),n.pixelStorei(n.PACK_ROW_LENGTH,0),n.pixelStorei(n.PACK_SKIP_PIXELS,0),n.pixelStorei(n.PACK_SKIP_ROWS,0),n.pixelStorei(n.UNPACK_ROW_LENGTH,0),n.pixelStorei(n.UNPACK_IMAGE_HEIGHT,0),n.pixelStorei(n.UNPACK_SKIP_PIXELS,0),n.pixelStorei(n.UNPACK_SKIP_ROWS,0),n.pixelStorei(n.UNPACK_SKIP_IMAGES,0),h={},d={},Q=null,et={},u={},l={},p=new WeakMap,g=[],x=null,m=!1,f=null,_=null,M=null,b=null,E=null,T=null,v=null,S=new Zt(0,0,0),N=0,P=!1,U=null,D=null,F=null,L=null,z=null,K.set(0,0,n.canvas.width,n.canvas.height),mt.set(0,0,n.canvas.width,n.canvas.height),r.reset(),o.reset(),a.reset()}return{buffers:{color:r,depth:o,stencil:a},enable:gt,disable:Ft,bindFramebuffer:Me,drawBuffers:Pt,useProgram:ie,setBlending:He,setMaterial:Pe,setFlipSided:sn,setCullFace:ve,setLineWidth:On,setPolygonOffset:Fe,setScissorTest:mn,activeTexture:gn,bindTexture:vn,unbindTexture:O,compressedTexImage2D:_n,compressedTexImage3D:de,texImage2D:w,texImage3D:V,pixelStorei:J,getParameter:nt,updateUBOMapping:Y,uniformBlockBinding:Z,texStorage2D:Ut,texStorage3D:A,texSubImage2D:pe,texSubImage3D:dt,compressedTexSubImage2D:Le,compressedTexSubImage3D:Rt,scissor:rt,viewport:ht,reset:at}}function Sy(n,t,e,i,s,r,o){const a=t.has("WEBGL_multisampled_render_to_texture")?t.get("WEBGL_multisampled_render_to_texture"):null,l=typeof navigator>"u"?!1:/OculusBrowser/g.test(navigator.userAgent),c=new It,h=new WeakMap,d=new Set;let u;const p=new WeakMap,g=new Set,x=new FinalizationRegistry(A=>g.delete(A));let m=!1;try{m=typeof OffscreenCanvas<"u"&&new OffscreenCanvas(1,1).getContext("2d")!==null}catch{}function f(A,w){return m?new OffscreenCanvas(A,w):ua("canvas")}function _(A,w,V){let nt=1;const J=Ut(A);if((J.width>V||J.height>V)&&(nt=V/Math.max(J.width,J.height)),nt<1)if(typeof HTMLImageElement<"u"&&A instanceof HTMLImageElement||typeof HTMLCanvasElement<"u"&&A instanceof HTMLCanvasElement||typeof ImageBitmap<"u"&&A instanceof ImageBitmap||typeof VideoFrame<"u"&&A instanceof VideoFrame){const rt=Math.floor(nt*J.width),ht=Math.floor(nt*J.height);u===void 0&&(u=f(rt,ht));const Y=w?f(rt,ht):u;return Y.width=rt,Y.height=ht,Y.getContext("2d").drawImage(A,0,0,rt,ht),Dt("WebGLRenderer: Texture has been resized from ("+J.width+"x"+J.height+") to ("+rt+"x"+ht+")."),Y}else return"data"in A&&Dt("WebGLRenderer: Image in DataTexture is too big ("+J.width+"x"+J.height+")."),A;return A}function M(A){return A.generateMipmaps}function b(A){n.generateMipmap(A)}function E(A){return A.isWebGLCubeRenderTarget?n.TEXTURE_CUBE_MAP:A.isWebGL3DRenderTarget?n.TEXTURE_3D:A.isWebGLArrayRenderTarget||A.isCompressedArrayTexture?n.TEXTURE_2D_ARRAY:n.TEXTURE_2D}function T(A,w,V,nt,J,rt=!1){if(A!==null){if(n[A]!==void 0)return n[A];Dt("WebGLRenderer: Attempt to use non-existing WebGL internal format '"+A+"'")}let ht;nt&&(ht=t.get("EXT_texture_norm16"),ht||Dt("WebGLRenderer: Unable to use normalized textures without EXT_texture_norm16 extension"));let Y=w;if(w===n.RED&&(V===n.FLOAT&&(Y=n.R32F),V===n.HALF_FLOAT&&(Y=n.R16F),V===n.UNSIGNED_BYTE&&(Y=n.R8),V===n.UNSIGNED_SHORT&&ht&&(Y=ht.R16_EXT),V===n.SHORT&&ht&&(Y=ht.R16_SNORM_EXT)),w===n.RED_INTEGER&&(V===n.UNSIGNED_BYTE&&(Y=n.R8UI),V===n.UNSIGNED_SHORT&&(Y=n.R16UI),V===n.UNSIGNED_INT&&(Y=n.R32UI),V===n.BYTE&&(Y=n.R8I),V===n.SHORT&&(Y=n.R16I),V===n.INT&&(Y=n.R32I)),w===n.RG&&(V===n.FLOAT&&(Y=n.RG32F),V===n.HALF_FLOAT&&(Y=n.RG16F),V===n.UNSIGNED_BYTE&&(Y=n.RG8),V===n.UNSIGNED_SHORT&&ht&&(Y=ht.RG16_EXT),V===n.SHORT&&ht&&(Y=ht.RG16_SNORM_EXT)),w===n.RG_INTEGER&&(V===n.UNSIGNED_BYTE&&(Y=n.RG8UI),V===n.UNSIGNED_SHORT&&(Y=n.RG16UI),V===n.UNSIGNED_INT&&(Y=n.RG32UI),V===n.BYTE&&(Y=n.RG8I),V===n.SHORT&&(Y=n.RG16I),V===n.INT&&(Y=n.RG32I)),w===n.RGB_INTEGER&&(V===n.UNSIGNED_BYTE&&(Y=n.RGB8UI),V===n.UNSIGNED_SHORT&&(Y=n.RGB16UI),V===n.UNSIGNED_INT&&(Y=n.RGB32UI),V===n.BYTE&&(Y=n.RGB8I),V===n.SHORT&&(Y=n.RGB16I),V===n.INT&&(Y=n.RGB32I)),w===n.RGBA_INTEGER&&(V===n.UNSIGNED_BYTE&&(Y=n.RGBA8UI),V===n.UNSIGNED_SHORT&&(Y=n.RGBA16UI),V===n.UNSIGNED_INT&&(Y=n.RGBA32UI),V===n.BYTE&&(Y=n.RGBA8I),V===n.SHORT&&(Y=n.RGBA16I),V===n.INT&&(Y=n.RGBA32I)),w===n.RGB&&(V===n.UNSIGNED_SHORT&&ht&&(Y=ht.RGB16_EXT),V===n.SHORT&&ht&&(Y=ht.RGB16_SNORM_EXT),V===n.UNSIGNED_INT_5_9_9_9_REV&&(Y=n.RGB9_E5),V===n.UNSIGNED_INT_10F_11F_11F_REV&&(Y=n.R11F_G11F_B10F)),w===n.RGBA){const Z=rt?ca:qt.getTransfer(J);V===n.FLOAT&&(Y=n.RGBA32F),V===n.HALF_FLOAT&&(Y=n.RGBA16F),V===n.UNSIGNED_BYTE&&(Y=Z===re?n.SRGB8_ALPHA8:n.RGBA8),V===n.UNSIGNED_SHORT&&ht&&(Y=ht.RGBA16_EXT),V===n.SHORT&&ht&&(Y=ht.RGBA16_SNORM_EXT),V===n.UNSIGNED_SHORT_4_4_4_4&&(Y=n.RGBA4),V===n.UNSIGNED_SHORT_5_5_5_1&&(Y=n.RGB5_A1)}return(Y===n.R16F||Y===n.R32F||Y===n.RG16F||Y===n.RG32F||Y===n.RGBA16F||Y===n.RGBA32F)&&t.get("EXT_color_buffer_float"),Y}function v(A,w){let V;return A?w===null||w===$n||w===Ws?V=n.DEPTH24_STENCIL8:w===Nn?V=n.DEPTH32F_STENCIL8:w===Dr&&(V=n.DEPTH24_STENCIL8,Dt("DepthTexture: 16 bit depth attachment is not supported with stencil. Using 24-bit attachment.")):w===null||w===$n||w===Ws?V=n.DEPTH_COMPONENT24:w===Nn?V=n.DEPTH_COMPONENT32F:w===Dr&&(V=n.DEPTH_COMPONENT16),V}function S(A,w){return M(A)===!0||A.isFramebufferTexture&&A.minFilter!==Se&&A.minFilter!==tn?Math.log2(Math.max(w.width,w.height))+1:A.mipmaps.length>0?A.mipmaps.length:A.isCompressedTexture&&Array.isArray(A.image)?w.mipmaps.length:1}function N(A){const w=new WeakRef(A);i.get(A).__ref=w,g.add(w),x.register(A,w,w)}function P(A){const w=i.get(A).__ref;w!==void 0&&(g.delete(w),x.unregister(w))}function U(A){F(A.target)}function D(A){L(A.target)}function F(A){A.removeEventListener("dispose",U),P(A),$(A),A.isVideoTexture&&h.delete(A),A.isHTMLTexture&&d.delete(A)}function L(A){A.removeEventListener("dispose",D),P(A),tt(A)}function z(){for(const A of g){const w=A.deref();w!==void 0&&(w.isRenderTarget===!0?L(w):F(w))}g.clear(),d.clear()}function $(A){const w=i.get(A);if(w.__webglInit===void 0)return;const V=A.source,nt=p.get(V);if(nt){const J=nt[w.__cacheKey];J.usedTimes--,J.usedTimes===0&&k(A),Object.keys(nt).length===0&&p.delete(V)}i.remove(A)}function k(A){const w=i.get(A);n.deleteTexture(w.__webglTexture);const V=A.source,nt=p.get(V);delete nt[w.__cacheKey],o.memory.textures--}function tt(A){const w=i.get(A);w.__depthDisposeCallback&&w.__depthDisposeCallback();const V=A.depthTexture;if(V&&V.renderTarget===A&&F(V),A.isWebGLCubeRenderTarget)for(let J=0;J<6;J++){if(Array.isArray(w.__webglFramebuffer[J]))for(let rt=0;rt<w.__webglFramebuffer[J].length;rt++)n.deleteFramebuffer(w.__webglFramebuffer[J][rt]);else n.deleteFramebuffer(w.__webglFramebuffer[J]);w.__webglDepthbuffer&&n.deleteRenderbuffer(w.__webglDepthbuffer[J])}else{if(Array.isArray(w.__webglFramebuffer))for(let J=0;J<w.__webglFramebuffer.length;J++)n.deleteFramebuffer(w.__webglFramebuffer[J]);else n.deleteFramebuffer(w.__webglFramebuffer);if(w.__webglDepthbuffer&&n.deleteRenderbuffer(w.__webglDepthbuffer),w.__webglMultisampledFramebuffer&&n.deleteFramebuffer(w.__webglMultisampledFramebuffer),w.__webglColorRenderbuffer)for(let J=0;J<w.__webglColorRenderbuffer.length;J++)w.__webglColorRenderbuffer[J]&&n.deleteRenderbuffer(w.__webglColorRenderbuffer[J]);w.__webglDepthRenderbuffer&&n.deleteRenderbuffer(w.__webglDepthRenderbuffer)}const nt=A.textures;for(let J=0,rt=nt.length;J<rt;J++){const ht=i.get(nt[J]);ht.__webglTexture&&(n.deleteTexture(ht.__webglTexture),o.memory.textures--),i.remove(nt[J])}i.remove(A)}let W=0;function Q(){W=0}function et(){return W}function xt(A){W=A}function Nt(){const A=W;return A>=s.maxTextures&&Dt("WebGLTextures: Trying to use "+(A+1)+" texture units while this GPU supports only "+s.maxTextures),W+=1,A}function K(A){const w=[];return w.push(A.wrapS),w.push(A.wrapT),w.push(A.wrapR||0),w.push(A.magFilter),w.push(A.minFilter),w.push(A.anisotropy),w.push(A.internalFormat),w.push(A.format),w.push(A.type),w.push(A.generateMipmaps),w.push(A.mipmapsAutoUpdate),w.push(A.premultiplyAlpha),w.push(A.flipY),w.push(A.unpackAlignment),w.push(A.colorSpace),w.join()}function mt(A,w){const V=i.get(A);if(A.isVideoTexture&&Le(A),A.isRenderTargetTexture===!1&&A.isExternalTexture!==!0&&A.version>0&&V.__version!==A.version){const nt=A.image;if(nt===null)Dt("WebGLRenderer: Texture marked for update but no image data found.");else if(nt.complete===!1)Dt("WebGLRenderer: Texture marked for update but image is incomplete");else{Pe(V,A,w);return}}else A.isExternalTexture&&(V.__webglTexture=A.sourceTexture?A.sourceTexture:null);e.bindTexture(n.TEXTURE_2D,V.__webglTexture,n.TEXTURE0+w)}function wt(A,w){const V=i.get(A);if(A.isRenderTargetTexture===!1&&A.version>0&&V.__version!==A.version){Pe(V,A,w);return}else A.isExternalTexture&&(V.__webglTexture=A.sourceTexture?A.sourceTexture:null);e.bindTexture(n.TEXTURE_2D_ARRAY,V.__webglTexture,n.TEXTURE0+w)}function Ct(A,w){const V=i.get(A);if(A.isRenderTargetTexture===!1&&A.version>0&&V.__version!==A.version){Pe(V,A,w);return}e.bindTexture(n.TEXTURE_3D,V.__webglTexture,n.TEXTURE0+w)}function gt(A,w){const V=i.get(A);if(A.version>0&&V.__version!==A.version){sn(V,A,w);return}e.bindTexture(n.TEXTURE_CUBE_MAP,V.__webglTexture,n.TEXTURE0+w)}const Ft={[ql]:n.REPEAT,[oi]:n.CLAMP_TO_EDGE,[$l]:n.MIRRORED_REPEAT},Me={[Se]:n.NEAREST,[O0]:n.NEAREST_MIPMAP_NEAREST,[co]:n.NEAREST_MIPMAP_LINEAR,[tn]:n.LINEAR,[Xa]:n.LINEAR_MIPMAP_NEAREST,[Ni]:n.LINEAR_MIPMAP_LINEAR},Pt={[z0]:n.NEVER,[cf]:n.ALWAYS,[V0]:n.LESS,[af]:n.LEQUAL,[H0]:n.EQUAL,[lf]:n.GEQUAL,[G0]:n.GREATER,[W0]:n.NOTEQUAL};function ie(A,w){if(w.type===Nn&&t.has("OES_texture_float_linear")===!1&&(w.magFilter===tn||w.magFilter===Xa||w.magFilter===co||w.magFilter===Ni||w.minFilter===tn||w.minFilter===Xa||w.minFilter===co||w.minFilter===Ni)&&Dt("WebGLRenderer: Unable to use linear filtering with floating point textures. OES_texture_float_linear not supported on this device."),n.texParameteri(A,n.TEXTURE_WRAP_S,Ft[w.wrapS]),n.texParameteri(A,n.TEXTURE_WRAP_T,Ft[w.wrapT]),(A===n.TEXTURE_3D||A===n.TEXTURE_2D_ARRAY)&&n.texParameteri(A,n.TEXTURE_WRAP_R,Ft[w.wrapR]),n.texParameteri(A,n.TEXTURE_MAG_FILTER,Me[w.magFilter]),n.texParameteri(A,n.TEXTURE_MIN_FILTER,Me[w.minFilter]),w.compareFunction&&(n.texParameteri(A,n.TEXTURE_COMPARE_MODE,n.COMPARE_REF_TO_TEXTURE),n.texParameteri(A,n.TEXTURE_COMPARE_FUNC,Pt[w.compareFunction])),t.has("EXT_texture_filter_anisotropic")===!0){if(w.magFilter===Se||w.minFilter!==co&&w.minFilter!==Ni||w.type===Nn&&t.has("OES_texture_float_linear")===!1)return;if(w.anisotropy>1||i.get(w).__currentAnisotropy){const V=t.get("EXT_texture_filter_anisotropic");n.texParameterf(A,V.TEXTURE_MAX_ANISOTROPY_EXT,Math.min(w.anisotropy,s.getMaxAnisotropy())),i.get(w).__currentAnisotropy=w.anisotropy}}}function oe(A,w){let V=!1;A.__webglInit===void 0&&(A.__webglInit=!0,w.addEventListener("dispose",U),N(w));const nt=w.source;let J=p.get(nt);J===void 0&&(J={},p.set(nt,J));const rt=K(w);if(rt!==A.__cacheKey){J[rt]===void 0&&(J[rt]={texture:n.createTexture(),usedTimes:0},o.memory.textures++,V=!0),J[rt].usedTimes++;const ht=J[A.__cacheKey];ht!==void 0&&(J[A.__cacheKey].usedTimes--,ht.usedTimes===0&&k(w)),A.__cacheKey=rt,A.__webglTexture=J[rt].texture}return V}function Gt(A,w,V){return Math.floor(Math.floor(A/V)/w)}function He(A,w,V,nt){const rt=A.updateRanges;if(rt.length===0)e.texSubImage2D(n.TEXTURE_2D,0,0,0,w.width,w.height,V,nt,w.data);else{rt.sort((R,j)=>R.start-j.start);let ht=0;for(let R=1;R<rt.length;R++){const j=rt[ht],q=rt[R],lt=j.start+j.count,st=Gt(q.start,w.width,4),ot=Gt(j.start,w.width,4);q.start<=lt+1&&st===ot&&Gt(q.start+q.count-1,w.width,4)===st?j.count=Math.max(j.count,q.start+q.count-j.start):(++ht,rt[ht]=q)}rt.length=ht+1;const Y=e.getParameter(n.UNPACK_ROW_LENGTH),Z=e.getParameter(n.UNPACK_SKIP_PIXELS),at=e.getParameter(n.UNPACK_SKIP_ROWS);e.pixelStorei(n.UNPACK_ROW_LENGTH,w.width);for(let R=0,j=rt.length;R<j;R++){const q=rt[R],lt=Math.floor(q.start/4),st=Math.ceil(q.count/4),ot=lt%w.width,Mt=Math.floor(lt/w.width),Bt=st,it=1;e.pixelStorei(n.UNPACK_SKIP_PIXELS,ot),e.pixelStorei(n.UNPACK_SKIP_ROWS,Mt),e.texSubImage2D(n.TEXTURE_2D,0,ot,Mt,Bt,it,V,nt,w.data)}A.clearUpdateRanges(),e.pixelStorei(n.UNPACK_ROW_LENGTH,Y),e.pixelStorei(n.UNPACK_SKIP_PIXELS,Z),e.pixelStorei(n.UNPACK_SKIP_ROWS,at)}}function Pe(A,w,V){let nt=n.TEXTURE_2D;(w.isDataArrayTexture||w.isCompressedArrayTexture)&&(nt=n.TEXTURE_2D_ARRAY),w.isData3DTexture&&(nt=n.TEXTURE_3D);const J=oe(A,w),rt=w.source;e.bindTexture(nt,A.__webglTexture,n.TEXTURE0+V);const ht=i.get(rt);if(rt.version!==ht.__version||J===!0){if(e.activeTexture(n.TEXTURE0+V),(typeof ImageBitmap<"u"&&w.image instanceof ImageBitmap)===!1){const it=qt.getPrimaries(qt.workingColorSpace),Tt=w.colorSpace===Di?null:qt.getPrimaries(w.colorSpace),kt=w.colorSpace===Di||it===Tt?n.NONE:n.BROWSER_DEFAULT_WEBGL;e.pixelStorei(n.UNPACK_FLIP_Y_WEBGL,w.flipY),e.pixelStorei(n.UNPACK_PREMULTIPLY_ALPHA_WEBGL,w.premultiplyAlpha),e.pixelStorei(n.UNPACK_COLORSPACE_CONVERSION_WEBGL,kt)}e.pixelStorei(n.UNPACK_ALIGNMENT,w.unpackAlignment);let Z=_(w.image,!1,s.maxTextureSize);Z=Rt(w,Z);const at=r.convert(w.format,w.colorSpace),R=r.convert(w.type);let j=T(w.internalFormat,at,R,w.normalized,w.colorSpace,w.isVideoTexture);ie(nt,w);let q;const lt=w.mipmaps,st=w.isVideoTexture!==!0,ot=ht.__version===void 0||J===!0,Mt=rt.dataReady,Bt=S(w,Z);if(w.isDepthTexture)j=v(w.format===Ui,w.type),ot&&(st?e.texStorage2D(n.TEXTURE_2D,1,j,Z.width,Z.height):e.texImage2D(n.TEXTURE_2D,0,j,Z.width,Z.height,0,at,R,null));else if(w.isDataTexture)if(lt.length>0){st&&ot&&e.texStorage2D(n.TEXTURE_2D,Bt,j,lt[0].width,lt[0].height);for(let it=0,Tt=lt.length;it<Tt;it++)q=lt[it],st?Mt&&e.texSubImage2D(n.TEXTURE_2D,it,0,0,q.width,q.height,at,R,q.data):e.texImage2D(n.TEXTURE_2D,it,j,q.width,q.height,0,at,R,q.data);w.generateMipmaps=!1}else st?(ot&&e.texStorage2D(n.TEXTURE_2D,Bt,j,Z.width,Z.height),Mt&&He(w,Z,at,R)):e.texImage2D(n.TEXTURE_2D,0,j,Z.width,Z.height,0,at,R,Z.data);else if(w.isCompressedTexture)if(w.isCompressedArrayTexture){st&&ot&&e.texStorage3D(n.TEXTURE_2D_ARRAY,Bt,j,lt[0].width,lt[0].height,Z.depth);for(let it=0,Tt=lt.length;it<Tt;it++)if(q=lt[it],w.format!==Wn)if(at!==null)if(st){if(Mt)if(w.layerUpdates.size>0){const kt=Xu(q.width,q.height,w.format,w.type);for(const pt of w.layerUpdates){const se=q.data.subarray(pt*kt/q.data.BYTES_PER_ELEMENT,(pt+1)*kt/q.data.BYTES_PER_ELEMENT);e.compressedTexSubImage3D(n.TEXTURE_2D_ARRAY,it,0,0,pt,q.width,q.height,1,at,se)}}else e.compressedTexSubImage3D(n.TEXTURE_2D_ARRAY,it,0,0,0,q.width,q.height,Z.depth,at,q.data)}else e.compressedTexImage3D(n.TEXTURE_2D_ARRAY,it,j,q.width,q.height,Z.depth,0,q.data,0,0);else Dt("WebGLRenderer: Attempt to load unsupported compressed texture format in .uploadTexture()");else st?Mt&&e.texSubImage3D(n.TEXTURE_2D_ARRAY,it,0,0,0,q.width,q.height,Z.depth,at,R,q.data):e.texImage3D(n.TEXTURE_2D_ARRAY,it,j,q.width,q.height,Z.depth,0,at,R,q.data);w.layerUpdates.size>0&&w.clearLayerUpdates()}else{st&&ot&&e.texStorage2D(n.TEXTURE_2D,Bt,j,lt[0].width,lt[0].height);for(let it=0,Tt=lt.length;it<Tt;it++)q=lt[it],w.format!==Wn?at!==null?st?Mt&&e.compressedTexSubImage2D(n.TEXTURE_2D,it,0,0,q.width,q.height,at,q.data):e.compressedTexImage2D(n.TEXTURE_2D,it,j,q.width,q.height,0,q.data):Dt("WebGLRenderer: Attempt to load unsupported compressed texture format in .uploadTexture()"):st?Mt&&e.texSubImage2D(n.TEXTURE_2D,it,0,0,q.width,q.height,at,R,q.data):e.texImage2D(n.TEXTURE_2D,it,j,q.width,q.height,0,at,R,q.data)}else if(w.isDataArrayTexture)if(st){if(ot&&e.texStorage3D(n.TEXTURE_2D_ARRAY,Bt,j,Z.width,Z.height,Z.depth),Mt)if(w.layerUpdates.size>0){const it=Xu(Z.width,Z.height,w.format,w.type);for(const Tt of w.layerUpdates){const kt=Z.data.subarray(Tt*it/Z.data.BYTES_PER_ELEMENT,(Tt+1)*it/Z.data.BYTES_PER_ELEMENT);e.texSubImage3D(n.TEXTURE_2D_ARRAY,0,0,0,Tt,Z.width,Z.height,1,at,R,kt)}w.clearLayerUpdates()}else e.texSubImage3D(n.TEXTURE_2D_ARRAY,0,0,0,0,Z.width,Z.height,Z.depth,at,R,Z.data)}else e.texImage3D(n.TEXTURE_2D_ARRAY,0,j,Z.width,Z.height,Z.depth,0,at,R,Z.data);else if(w.isData3DTexture)st?(ot&&e.texStorage3D(n.TEXTURE_3D,Bt,j,Z.width,Z.height,Z.depth),Mt&&e.texSubImage3D(n.TEXTURE_3D,0,0,0,0,Z.width,Z.height,Z.depth,at,R,Z.data)):e.texImage3D(n.TEXTURE_3D,0,j,Z.width,Z.height,Z.depth,0,at,R,Z.data);else if(w.isFramebufferTexture){if(ot)if(st)e.texStorage2D(n.TEXTURE_2D,Bt,j,Z.width,Z.height);else{let it=Z.width,Tt=Z.height;for(let kt=0;kt<Bt;kt++)e.texImage2D(n.TEXTURE_2D,kt,j,it,Tt,0,at,R,null),it>>=1,Tt>>=1}}else if(w.isHTMLTexture){if("texElementImage2D"in n){const it=n.canvas;if(it.hasAttribute("layoutsubtree")||it.setAttribute("layoutsubtree","true"),Z.parentNode!==it){it.appendChild(Z),d.add(w),it.onpaint=Tt=>{const kt=Tt.changedElements;for(const pt of d)kt.includes(pt.image)&&(pt.needsUpdate=!0)},it.requestPaint();return}if(n.texElementImage2D.length===3)n.texElementImage2D(n.TEXTURE_2D,n.RGBA8,Z);else{const kt=n.RGBA,pt=n.RGBA,se=n.UNSIGNED_BYTE;n.texElementImage2D(n.TEXTURE_2D,0,kt,pt,se,Z)}n.texParameteri(n.TEXTURE_2D,n.TEXTURE_MIN_FILTER,n.LINEAR),n.texParameteri(n.TEXTURE_2D,n.TEXTURE_WRAP_S,n.CLAMP_TO_EDGE),n.texParameteri(n.TEXTURE_2D,n.TEXTURE_WRAP_T,n.CLAMP_TO_EDGE)}}else if(lt.length>0){if(st&&ot){const it=Ut(lt[0]);e.texStorage2D(n.TEXTURE_2D,Bt,j,it.width,it.height)}for(let it=0,Tt=lt.length;it<Tt;it++)q=lt[it],st?Mt&&e.texSubImage2D(n.TEXTURE_2D,it,0,0,at,R,q):e.texImage2D(n.TEXTURE_2D,it,j,at,R,q);w.generateMipmaps=!1}else if(st){if(ot){const it=Ut(Z);e.texStorage2D(n.TEXTURE_2D,Bt,j,it.width,it.height)}Mt&&e.texSubImage2D(n.TEXTURE_2D,0,0,0,at,R,Z)}else e.texImage2D(n.TEXTURE_2D,0,j,at,R,Z);M(w)&&w.mipmapsAutoUpdate===!0&&b(nt),ht.__version=rt.version,w.onUpdate&&w.onUpdate(w)}A.__version=w.version}function sn(A,w,V){if(w.image.length!==6)return;const nt=oe(A,w),J=w.source;e.bindTexture(n.TEXTURE_CUBE_MAP,A.__webglTexture,n.TEXTURE0+V);const rt=i.get(J);if(J.version!==rt.__version||nt===!0){e.activeTexture(n.TEXTURE0+V);const ht=qt.getPrimaries(qt.workingColorSpace),Y=w.colorSpace===Di?null:qt.getPrimaries(w.colorSpace),Z=w.colorSpace===Di||ht===Y?n.NONE:n.BROWSER_DEFAULT_WEBGL;e.pixelStorei(n.UNPACK_FLIP_Y_WEBGL,w.flipY),e.pixelStorei(n.UNPACK_PREMULTIPLY_ALPHA_WEBGL,w.premultiplyAlpha),e.pixelStorei(n.UNPACK_ALIGNMENT,w.unpackAlignment),e.pixelStorei(n.UNPACK_COLORSPACE_CONVERSION_WEBGL,Z);const at=w.isCompressedTexture||w.image[0].isCompressedTexture,R=w.image[0]&&w.image[0].isDataTexture,j=[];for(let pt=0;pt<6;pt++)!at&&!R?j[pt]=_(w.image[pt],!0,s.maxCubemapSize):j[pt]=R?w.image[pt].image:w.image[pt],j[pt]=Rt(w,j[pt]);const q=j[0],lt=r.convert(w.format,w.colorSpace),st=r.convert(w.type);let ot=T(w.internalFormat,lt,st,w.normalized,w.colorSpace);const Mt=w.isVideoTexture!==!0,Bt=rt.__version===void 0||nt===!0,it=J.dataReady;let Tt=S(w,q);ie(n.TEXTURE_CUBE_MAP,w);let kt;if(w.isDepthTexture){if(ot=v(w.format===Ui,w.type),Bt)if(Mt)e.texStorage2D(n.TEXTURE_CUBE_MAP,1,ot,q.width,q.height);else for(let pt=0;pt<6;pt++)e.texImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+pt,0,ot,q.width,q.height,0,lt,st,null)}else if(at){Mt&&Bt&&e.texStorage2D(n.TEXTURE_CUBE_MAP,Tt,ot,q.width,q.height);for(let pt=0;pt<6;pt++){kt=j[pt].mipmaps;for(let se=0;se<kt.length;se++){const ke=kt[se];w.format!==Wn?lt!==null?Mt?it&&e.compressedTexSubImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+pt,se,0,0,ke.width,ke.height,lt,ke.data):e.compressedTexImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+pt,se,ot,ke.width,ke.height,0,ke.data):Dt("WebGLRenderer: Attempt to load unsupported compressed texture format in .setTextureCube()"):Mt?it&&e.texSubImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+pt,se,0,0,ke.width,ke.height,lt,st,ke.data):e.texImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+pt,se,ot,ke.width,ke.height,0,lt,st,ke.data)}}}else{if(kt=w.mipmaps,Mt&&Bt){kt.length>0&&Tt++;const pt=Ut(j[0]);e.texStorage2D(n.TEXTURE_CUBE_MAP,Tt,ot,pt.width,pt.height)}for(let pt=0;pt<6;pt++)if(R){Mt?it&&e.texSubImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+pt,0,0,0,j[pt].width,j[pt].height,lt,st,j[pt].data):e.texImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+pt,0,ot,j[pt].width,j[pt].height,0,lt,st,j[pt].data);for(let se=0;se<kt.length;se++){const bi=kt[se].image[pt].image;Mt?it&&e.texSubImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+pt,se+1,0,0,bi.width,bi.height,lt,st,bi.data):e.texImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+pt,se+1,ot,bi.width,bi.height,0,lt,st,bi.data)}}else{Mt?it&&e.texSubImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+pt,0,0,0,lt,st,j[pt]):e.texImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+pt,0,ot,lt,st,j[pt]);for(let se=0;se<kt.length;se++){const ke=kt[se];Mt?it&&e.texSubImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+pt,se+1,0,0,lt,st,ke.image[pt]):e.texImage2D(n.TEXTURE_CUBE_MAP_POSITIVE_X+pt,se+1,ot,lt,st,ke.image[pt])}}}M(w)&&w.mipmapsAutoUpdate===!0&&b(n.TEXTURE_CUBE_MAP),rt.__version=J.version,w.onUpdate&&w.onUpdate(w)}A.__version=w.version}function ve(A,w,V,nt,J,rt){const ht=r.convert(V.format,V.colorSpace),Y=r.convert(V.type),Z=T(V.internalFormat,ht,Y,V.normalized,V.colorSpace),at=i.get(w),R=i.get(V);if(R.__renderTarget=w,!at.__hasExternalTextures){const j=Math.max(1,w.width>>rt),q=Math.max(1,w.height>>rt);J===n.TEXTURE_3D||J===n.TEXTURE_2D_ARRAY?e.texImage3D(J,rt,Z,j,q,w.depth,0,ht,Y,null):e.texImage2D(J,rt,Z,j,q,0,ht,Y,null)}e.bindFramebuffer(n.FRAMEBUFFER,A),dt(w)?a.framebufferTexture2DMultisampleEXT(n.FRAMEBUFFER,nt,J,R.__webglTexture,0,pe(w)):(J===n.TEXTURE_2D||J>=n.TEXTURE_CUBE_MAP_POSITIVE_X&&J<=n.TEXTURE_CUBE_MAP_NEGATIVE_Z)&&n.framebufferTexture2D(n.FRAMEBUFFER,nt,J,R.__webglTexture,rt),e.bindFramebuffer(n.FRAMEBUFFER,null)}function On(A,w,V){if(n.bindRenderbuffer(n.RENDERBUFFER,A),w.depthBuffer){const nt=w.depthTexture,J=nt&&nt.isDepthTexture?nt.type:null,rt=v(w.stencilBuffer,J),ht=w.stencilBuffer?n.DEPTH_STENCIL_ATTACHMENT:n.DEPTH_ATTACHMENT;dt(w)?a.renderbufferStorageMultisampleEXT(n.RENDERBUFFER,pe(w),rt,w.width,w.height):V?n.renderbufferStorageMultisample(n.RENDERBUFFER,pe(w),rt,w.width,w.height):n.renderbufferStorage(n.RENDERBUFFER,rt,w.width,w.height),n.framebufferRenderbuffer(n.FRAMEBUFFER,ht,n.RENDERBUFFER,A)}else{const nt=w.textures;for(let J=0;J<nt.length;J++){const rt=nt[J],ht=r.convert(rt.format,rt.colorSpace),Y=r.convert(rt.type),Z=T(rt.internalFormat,ht,Y,rt.normalized,rt.colorSpace);dt(w)?a.renderbufferStorageMultisampleEXT(n.RENDERBUFFER,pe(w),Z,w.width,w.height):V?n.renderbufferStorageMultisample(n.RENDERBUFFER,pe(w),Z,w.width,w.height):n.renderbufferStorage(n.RENDERBUFFER,Z,w.width,w.height)}}n.bindRenderbuffer(n.RENDERBUFFER,null)}function Fe(A,w,V){const nt=w.isWebGLCubeRenderTarget===!0;if(e.bindFramebuffer(n.FRAMEBUFFER,A),!(w.depthTexture&&w.depthTexture.isDepthTexture))throw new Error("THREE.WebGLTextures: renderTarget.depthTexture must be an instance of THREE.DepthTexture.");const J=i.get(w.depthTexture);J.__renderTarget=w;const rt=nt?w.depthTexture.image[0]:w.depthTexture.image;(!J.__webglTexture||rt.width!==w.width||rt.height!==w.height)&&(rt.width=w.width,rt.height=w.height,w.depthTexture.needsUpdate=!0),nt?gt(w.depthTexture,0):mt(w.depthTexture,0);const ht=J.__webglTexture,Y=pe(w),Z=nt?n.TEXTURE_CUBE_MAP_POSITIVE_X+V:n.TEXTURE_2D,at=w.depthTexture.format===Ui?n.DEPTH_STENCIL_ATTACHMENT:n.DEPTH_ATTACHMENT;if(w.depthTexture.format===Bi)dt(w)?a.framebufferTexture2DMultisampleEXT(n.FRAMEBUFFER,at,Z,ht,0,Y):n.framebufferTexture2D(n.FRAMEBUFFER,at,Z,ht,0);else if(w.depthTexture.format===Ui)dt(w)?a.framebufferTexture2DMultisampleEXT(n.FRAMEBUFFER,at,Z,ht,0,Y):n.framebufferTexture2D(n.FRAMEBUFFER,at,Z,ht,0);else throw new Error("THREE.WebGLTextures: Unknown depthTexture format.")}function mn(A){const w=i.get(A),V=A.isWebGLCubeRenderTarget===!0;if(w.__boundDepthTexture!==A.depthTexture){const nt=A.depthTexture;if(w.__depthDisposeCallback&&w.__depthDisposeCallback(),nt){const J=()=>{delete w.__boundDepthTexture,delete w.__depthDisposeCallback,nt.removeEventListener("dispose",J)};nt.addEventListener("dispose",J),w.__depthDisposeCallback=J}w.__boundDepthTexture=nt}if(A.depthTexture&&!w.__autoAllocateDepthBuffer)if(V)for(let nt=0;nt<6;nt++)Fe(w.__webglFramebuffer[nt],A,nt);else A.texture.mipmaps.length>0?Fe(w.__webglFramebuffer[0],A,0):Fe(w.__webglFramebuffer,A,0);else if(V){w.__webglDepthbuffer=[];for(let nt=0;nt<6;nt++)if(e.bindFramebuffer(n.FRAMEBUFFER,w.__webglFramebuffer[nt]),w.__webglDepthbuffer[nt]===void 0)w.__webglDepthbuffer[nt]=n.createRenderbuffer(),On(w.__webglDepthbuffer[nt],A,!1);else{const J=A.stencilBuffer?n.DEPTH_STENCIL_ATTACHMENT:n.DEPTH_ATTACHMENT,rt=w.__webglDepthbuffer[nt];n.bindRenderbuffer(n.RENDERBUFFER,rt),n.framebufferRenderbuffer(n.FRAMEBUFFER,J,n.RENDERBUFFER,rt)}}else if(A.texture.mipmaps.length>0?e.bindFramebuffer(n.FRAMEBUFFER,w.__webglFramebuffer[0]):e.bindFramebuffer(n.FRAMEBUFFER,w.__webglFramebuffer),w.__webglDepthbuffer===void 0)w.__webglDepthbuffer=n.createRenderbuffer(),On(w.__webglDepthbuffer,A,!1);else{const J=A.stencilBuffer?n.DEPTH_STENCIL_ATTACHMENT:n.DEPTH_ATTACHMENT,rt=w.__webglDepthbuffer;n.bindRenderbuffer(n.RENDERBUFFER,rt),n.framebufferRenderbuffer(n.FRAMEBUFFER,J,n.RENDERBUFFER,rt)}e.bindFramebuffer(n.FRAMEBUFFER,null)}function gn(A,w,V){const nt=i.get(A);w!==void 0&&ve(nt.__webglFramebuffer,A,A.texture,n.COLOR_ATTACHMENT0,n.TEXTURE_2D,0),V!==void 0&&mn(A)}function vn(A){const w=A.texture,V=i.get(A),nt=i.get(w);A.addEventListener("dispose",D),N(A);const J=A.textures,rt=A.isWebGLCubeRenderTarget===!0,ht=J.length>1;if(ht||(nt.__webglTexture===void 0&&(nt.__webglTexture=n.createTexture()),nt.__version=w.version,o.memory.textures++),rt){V.__webglFramebuffer=[];for(let Y=0;Y<6;Y++)if(w.mipmaps.length>0){V.__webglFramebuffer[Y]=[];for(let Z=0;Z<w.mipmaps.length;Z++)V.__webglFramebuffer[Y][Z]=n.createFramebuffer()}else V.__webglFramebuffer[Y]=n.createFramebuffer()}else{if(w.mipmaps.length>0){V.__webglFramebuffer=[];for(let Y=0;Y<w.mipmaps.length;Y++)V.__webglFramebuffer[Y]=n.createFramebuffer()}else V.__webglFramebuffer=n.createFramebuffer();if(ht)for(let Y=0,Z=J.length;Y<Z;Y++){const at=i.get(J[Y]);at.__webglTexture===void 0&&(at.__webglTexture=n.createTexture(),o.memory.textures++)}if(A.samples>0&&dt(A)===!1){V.__webglMultisampledFramebuffer=n.createFramebuffer(),V.__webglColorRenderbuffer=[],e.bindFramebuffer(n.FRAMEBUFFER,V.__webglMultisampledFramebuffer);for(let Y=0;Y<J.length;Y++){const Z=J[Y];V.__webglColorRenderbuffer[Y]=n.createRenderbuffer(),n.bindRenderbuffer(n.RENDERBUFFER,V.__webglColorRenderbuffer[Y]);const at=r.convert(Z.format,Z.colorSpace),R=r.convert(Z.type),j=T(Z.internalFormat,at,R,Z.normalized,Z.colorSpace,A.isXRRenderTarget===!0),q=pe(A);n.renderbufferStorageMultisample(n.RENDERBUFFER,q,j,A.width,A.height),n.framebufferRenderbuffer(n.FRAMEBUFFER,n.COLOR_ATTACHMENT0+Y,n.RENDERBUFFER,V.__webglColorRenderbuffer[Y])}n.bindRenderbuffer(n.RENDERBUFFER,null),A.depthBuffer&&(V.__webglDepthRenderbuffer=n.createRenderbuffer(),On(V.__webglDepthRenderbuffer,A,!0)),e.bindFramebuffer(n.FRAMEBUFFER,null)}}if(rt){e.bindTexture(n.TEXTURE_CUBE_MAP,nt.__webglTexture),ie(n.TEXTURE_CUBE_MAP,w);for(let Y=0;Y<6;Y++)if(w.mipmaps.length>0)for(let Z=0;Z<w.mipmaps.length;Z++)ve(V.__webglFramebuffer[Y][Z],A,w,n.COLOR_ATTACHMENT0,n.TEXTURE_CUBE_MAP_POSITIVE_X+Y,Z);else ve(V.__webglFramebuffer[Y],A,w,n.COLOR_ATTACHMENT0,n.TEXTURE_CUBE_MAP_POSITIVE_X+Y,0);M(w)?b(n.TEXTURE_CUBE_MAP):w.mipmaps.length>0&&n.texParameteri(n.TEXTURE_CUBE_MAP,n.TEXTURE_MAX_LEVEL,w.mipmaps.length-1),e.unbindTexture()}else if(ht){for(let Y=0,Z=J.length;Y<Z;Y++){const at=J[Y],R=i.get(at);let j=n.TEXTURE_2D;(A.isWebGL3DRenderTarget||A.isWebGLArrayRenderTarget)&&(j=A.isWebGL3DRenderTarget?n.TEXTURE_3D:n.TEXTURE_2D_ARRAY),e.bindTexture(j,R.__webglTexture),ie(j,at),ve(V.__webglFramebuffer,A,at,n.COLOR_ATTACHMENT0+Y,j,0),M(at)&&b(j)}e.unbindTexture()}else{let Y=n.TEXTURE_2D;if((A.isWebGL3DRenderTarget||A.isWebGLArrayRenderTarget)&&(Y=A.isWebGL3DRenderTarget?n.TEXTURE_3D:n.TEXTURE_2D_ARRAY),e.bindTexture(Y,nt.__webglTexture),ie(Y,w),w.mipmaps.length>0)for(let Z=0;Z<w.mipmaps.length;Z++)ve(V.__webglFramebuffer[Z],A,w,n.COLOR_ATTACHMENT0,Y,Z);else ve(V.__webglFramebuffer,A,w,n.COLOR_ATTACHMENT0,Y,0);M(w)?b(Y):w.mipmaps.length>0&&n.texParameteri(Y,n.TEXTURE_MAX_LEVEL,w.mipmaps.length-1),e.unbindTexture()}A.depthBuffer&&mn(A)}function O(A){const w=A.textures;for(let V=0,nt=w.length;V<nt;V++){const J=w[V];if(M(J)&&J.mipmapsAutoUpdate===!0){const rt=E(A),ht=i.get(J).__webglTexture;e.bindTexture(rt,ht),b(rt),e.unbindTexture()}}}const _n=[];function de(A){if(A.samples>0){if(dt(A)===!1){const w=A.textures,V=A.width,nt=A.height;let J=n.COLOR_BUFFER_BIT;const rt=A.stencilBuffer?n.DEPTH_STENCIL_ATTACHMENT:n.DEPTH_ATTACHMENT,ht=i.get(A),Y=w.length>1;if(Y)for(let at=0;at<w.length;at++)e.bindFramebuffer(n.FRAMEBUFFER,ht.__webglMultisampledFramebuffer),n.framebufferRenderbuffer(n.FRAMEBUFFER,n.COLOR_ATTACHMENT0+at,n.RENDERBUFFER,null),e.bindFramebuffer(n.FRAMEBUFFER,ht.__webglFramebuffer),n.framebufferTexture2D(n.DRAW_FRAMEBUFFER,n.COLOR_ATTACHMENT0+at,n.TEXTURE_2D,null,0);e.bindFramebuffer(n.READ_FRAMEBUFFER,ht.__webglMultisampledFramebuffer),A.texture.mipmaps.length>0?e.bindFramebuffer(n.DRAW_FRAMEBUFFER,ht.__webglFramebuffer[0]):e.bindFramebuffer(n.DRAW_FRAMEBUFFER,ht.__webglFramebuffer);for(let at=0;at<w.length;at++){if(A.resolveDepthBuffer&&(A.depthBuffer&&(J|=n.DEPTH_BUFFER_BIT),A.stencilBuffer&&A.resolveStencilBuffer&&(J|=n.STENCIL_BUFFER_BIT)),Y){n.framebufferRenderbuffer(n.READ_FRAMEBUFFER,n.COLOR_ATTACHMENT0,n.RENDERBUFFER,ht.__webglColorRenderbuffer[at]);const R=i.get(w[at]).__webglTexture;n.framebufferTexture2D(n.DRAW_FRAMEBUFFER,n.COLOR_ATTACHMENT0,n.TEXTURE_2D,R,0)}n.blitFramebuffer(0,0,V,nt,0,0,V,nt,J,n.NEAREST),l===!0&&(_n.length=0,_n.push(n.COLOR_ATTACHMENT0+at),A.depthBuffer&&A.storeMultisampledDepthBuffer===!1&&_n.push(rt),n.invalidateFramebuffer(n.READ_FRAMEBUFFER,_n))}if(e.bindFramebuffer(n.READ_FRAMEBUFFER,null),e.bindFramebuffer(n.DRAW_FRAMEBUFFER,null),Y)for(let at=0;at<w.length;at++){e.bindFramebuffer(n.FRAMEBUFFER,ht.__webglMultisampledFramebuffer),n.framebufferRenderbuffer(n.FRAMEBUFFER,n.COLOR_ATTACHMENT0+at,n.RENDERBUFFER,ht.__webglColorRenderbuffer[at]);const R=i.get(w[at]).__webglTexture;e.bindFramebuffer(n.FRAMEBUFFER,ht.__webglFramebuffer),n.framebufferTexture2D(n.DRAW_FRAMEBUFFER,n.COLOR_ATTACHMENT0+at,n.TEXTURE_2D,R,0)}e.bindFramebuffer(n.DRAW_FRAMEBUFFER,ht.__webglMultisampledFramebuffer)}else if(A.depthBuffer&&A.storeMultisampledDepthBuffer===!1&&l){const w=A.stencilBuffer?n.DEPTH_STENCIL_ATTACHMENT:n.DEPTH_ATTACHMENT;n.invalidateFramebuffer(n.DRAW_FRAMEBUFFER,[w])}}}function pe(A){return Math.min(s.maxSamples,A.samples)}function dt(A){const w=i.get(A);return A.samples>0&&t.has("WEBGL_multisampled_render_to_texture")===!0&&w.__useRenderToTexture!==!1}function Le(A){const w=o.render.frame;h.get(A)!==w&&(h.set(A,w),A.update())}function Rt(A,w){const V=A.colorSpace,nt=A.format,J=A.type;return A.isCompressedTexture===!0||A.isVideoTexture===!0||V!==la&&V!==Di&&(qt.getTransfer(V)===re?(nt!==Wn||J!==yn)&&Dt("WebGLTextures: sRGB encoded textures have to use RGBAFormat and UnsignedByteType."):Qt("WebGLTextures: Unsupported texture color space:",V)),w}function Ut(A){return typeof HTMLImageElement<"u"&&A instanceof HTMLImageElement?(c.width=A.naturalWidth||A.width,c.height=A.naturalHeight||A.height):typeof VideoFrame<"u"&&A instanceof VideoFrame?(c.width=A.displayWidth,c.height=A.displayHeight):(c.width=A.width,c.height=A.height),c}this.allocateTextureUnit=Nt,this.resetTextureUnits=Q,this.getTextureUnits=et,this.setTextureUnits=xt,this.setTexture2D=mt,this.setTexture2DArray=wt,this.setTexture3D=Ct,this.setTextureCube=gt,this.rebindTextures=gn,this.setupRenderTarget=vn,this.updateRenderTargetMipmap=O,this.updateMultisampleRenderTarget=de,this.setupDepthRenderbuffer=mn,this.setupFrameBufferTexture=ve,this.useMultisampledRTT=dt,this.dispose=z}function Ey(n,t){function e(i,s=Di){let r;const o=qt.getTransfer(s);if(i===yn)return n.UNSIGNED_BYTE;if(i===qc)return n.UNSIGNED_SHORT_4_4_4_4;if(i===$c)return n.UNSIGNED_SHORT_5_5_5_1;if(i===nf)return n.UNSIGNED_INT_5_9_9_9_REV;if(i===sf)return n.UNSIGNED_INT_10F_11F_11F_REV;if(i===tf)return n.BYTE;if(i===ef)return n.SHORT;if(i===Dr)return n.UNSIGNED_SHORT;if(i===Xc)return n.INT;if(i===$n)return n.UNSIGNED_INT;if(i===Nn)return n.FLOAT;if(i===Yn)return n.HALF_FLOAT;if(i===rf)return n.ALPHA;if(i===of)return n.RGB;if(i===Wn)return n.RGBA;if(i===Bi)return n.DEPTH_COMPONENT;if(i===Ui)return n.DEPTH_STENCIL;if(i===Yc)return n.RED;if(i===Kc)return n.RED_INTEGER;if(i===is)return n.RG;if(i===Zc)return n.RG_INTEGER;if(i===jc)return n.RGBA_INTEGER;if(i===Yo||i===Ko||i===Zo||i===jo)if(o===re)if(r=t.get("WEBGL_compressed_texture_s3tc_srgb"),r!==null){if(i===Yo)return r.COMPRESSED_SRGB_S3TC_DXT1_EXT;if(i===Ko)return r.COMPRESSED_SRGB_ALPHA_S3TC_DXT1_EXT;if(i===Zo)return r.COMPRESSED_SRGB_ALPHA_S3TC_DXT3_EXT;if(i===jo)return r.COMPRESSED_SRGB_ALPHA_S3TC_DXT5_EXT}else return null;else if(r=t.get("WEBGL_compressed_texture_s3tc"),r!==null){if(i===Yo)return r.COMPRESSED_RGB_S3TC_DXT1_EXT;if(i===Ko)return r.COMPRESSED_RGBA_S3TC_DXT1_EXT;if(i===Zo)return r.COMPRESSED_RGBA_S3TC_DXT3_EXT;if(i===jo)return r.COMPRESSED_RGBA_S3TC_DXT5_EXT}else return null;if(i===Yl||i===Kl||i===Zl||i===jl)if(r=t.get("WEBGL_compressed_texture_pvrtc"),r!==null){if(i===Yl)return r.COMPRESSED_RGB_PVRTC_4BPPV1_IMG;if(i===Kl)return r.COMPRESSED_RGB_PVRTC_2BPPV1_IMG;if(i===Zl)return r.COMPRESSED_RGBA_PVRTC_4BPPV1_IMG;if(i===jl)return r.COMPRESSED_RGBA_PVRTC_2BPPV1_IMG}else return null;if(i===Ql||i===Jl||i===tc||i===ec||i===nc||i===oa||i===ic)if(r=t.get("WEBGL_compressed_texture_etc"),r!==null){if(i===Ql||i===Jl)return o===re?r.COMPRESSED_SRGB8_ETC2:r.COMPRESSED_RGB8_ETC2;if(i===tc)return o===re?r.COMPRESSED_SRGB8_ALPHA8_ETC2_EAC:r.COMPRESSED_RGBA8_ETC2_EAC;if(i===ec)return r.COMPRESSED_R11_EAC;if(i===nc)return r.COMPRESSED_SIGNED_R11_EAC;if(i===oa)return r.COMPRESSED_RG11_EAC;if(i===ic)return r.COMPRESSED_SIGNED_RG11_EAC}else return null;if(i===sc||i===rc||i===oc||i===ac||i===lc||i===cc||i===hc||i===uc||i===dc||i===pc||i===fc||i===mc||i===gc||i===vc)if(r=t.get("WEBGL_compressed_texture_astc"),r!==null){if(i===sc)return o===re?r.COMPRESSED_SRGB8_ALPHA8_ASTC_4x4_KHR:r.COMPRESSED_RGBA_ASTC_4x4_KHR;if(i===rc)return o===re?r.COMPRESSED_SRGB8_ALPHA8_ASTC_5x4_KHR:r.COMPRESSED_RGBA_ASTC_5x4_KHR;if(i===oc)return o===re?r.COMPRESSED_SRGB8_ALPHA8_ASTC_5x5_KHR:r.COMPRESSED_RGBA_ASTC_5x5_KHR;if(i===ac)return o===re?r.COMPRESSED_SRGB8_ALPHA8_ASTC_6x5_KHR:r.COMPRESSED_RGBA_ASTC_6x5_KHR;if(i===lc)return o===re?r.COMPRESSED_SRGB8_ALPHA8_ASTC_6x6_KHR:r.COMPRESSED_RGBA_ASTC_6x6_KHR;if(i===cc)return o===re?r.COMPRESSED_SRGB8_ALPHA8_ASTC_8x5_KHR:r.COMPRESSED_RGBA_ASTC_8x5_KHR;if(i===hc)return o===re?r.COMPRESSED_SRGB8_ALPHA8_ASTC_8x6_KHR:r.COMPRESSED_RGBA_ASTC_8x6_KHR;if(i===uc)return o===re?r.COMPRESSED_SRGB8_ALPHA8_ASTC_8x8_KHR:r.COMPRESSED_RGBA_ASTC_8x8_KHR;if(i===dc)return o===re?r.COMPRESSED_SRGB8_ALPHA8_ASTC_10x5_KHR:r.COMPRESSED_RGBA_ASTC_10x5_KHR;if(i===pc)return o===re?r.COMPRESSED_SRGB8_ALPHA8_ASTC_10x6_KHR:r.COMPRESSED_RGBA_ASTC_10x6_KHR;if(i===fc)return o===re?r.COMPRESSED_SRGB8_ALPHA8_ASTC_10x8_KHR:r.COMPRESSED_RGBA_ASTC_10x8_KHR;if(i===mc)return o===re?r.COMPRESSED_SRGB8_ALPHA8_ASTC_10x10_KHR:r.COMPRESSED_RGBA_ASTC_10x10_KHR;if(i===gc)return o===re?r.COMPRESSED_SRGB8_ALPHA8_ASTC_12x10_KHR:r.COMPRESSED_RGBA_ASTC_12x10_KHR;if(i===vc)return o===re?r.COMPRESSED_SRGB8_ALPHA8_ASTC_12x12_KHR:r.COMPRESSED_RGBA_ASTC_12x12_KHR}else return null;if(i===_c||i===xc||i===bc)if(r=t.get("EXT_texture_compression_bptc"),r!==null){if(i===_c)return o===re?r.COMPRESSED_SRGB_ALPHA_BPTC_UNORM_EXT:r.COMPRESSED_RGBA_BPTC_UNORM_EXT;if(i===xc)return r.COMPRESSED_RGB_BPTC_SIGNED_FLOAT_EXT;if(i===bc)return r.COMPRESSED_RGB_BPTC_UNSIGNED_FLOAT_EXT}else return null;if(i===wc||i===yc||i===aa||i===Sc)if(r=t.get("EXT_texture_compression_rgtc"),r!==null){if(i===wc)return r.COMPRESSED_RED_RGTC1_EXT;if(i===yc)return r.COMPRESSED_SIGNED_RED_RGTC1_EXT;if(i===aa)return r.COMPRESSED_RED_GREEN_RGTC2_EXT;if(i===Sc)return r.COMPRESSED_SIGNED_RED_GREEN_RGTC2_EXT}else return null;return i===Ws?n.UNSIGNED_INT_24_8:n[i]!==void 0?n[i]:null}return{convert:e}}const My=`
void main() {

	gl_Position = vec4( position, 1.0 );

}`,Ty=`
uniform sampler2DArray depthColor;
uniform float depthWidth;
uniform float depthHeight;

void main() {

	vec2 coord = vec2( gl_FragCoord.x / depthWidth, gl_FragCoord.y / depthHeight );

	if ( coord.x >= 1.0 ) {

		gl_FragDepth = texture( depthColor, vec3( coord.x - 1.0, coord.y, 1 ) ).r;

	} else {

		gl_FragDepth = texture( depthColor, vec3( coord.x, coord.y, 0 ) ).r;

	}

}`;class Ay{constructor(){this.texture=null,this.mesh=null,this.depthNear=0,this.depthFar=0}init(t,e){if(this.texture===null){const i=new Ef(t.texture);(t.depthNear!==e.depthNear||t.depthFar!==e.depthFar)&&(this.depthNear=t.depthNear,this.depthFar=t.depthFar),this.texture=i}}getMesh(t){if(this.texture!==null&&this.mesh===null){const e=t.cameras[0].viewport,i=new dn({vertexShader:My,fragmentShader:Ty,uniforms:{depthColor:{value:this.texture},depthWidth:{value:e.z},depthHeight:{value:e.w}}});this.mesh=new _t(new Vi(20,20),i)}return this.mesh}reset(){this.texture=null,this.mesh=null}getDepthTexture(){return this.texture}}class Cy extends Gi{constructor(t,e){super();const i=this;let s=null,r=1,o=null,a="local-floor",l=1,c=null,h=null,d=null,u=null,p=null,g=null;const x=typeof XRWebGLBinding<"u",m=new Ay,f={},_=e.getContextAttributes();let M=null,b=null;const E=[],T=[],v=new It;let S=null,N=null;const P=new Pn;P.viewport=new Ee;const U=new Pn;U.viewport=new Ee;const D=[P,U],F=new zv;let L=null,z=null;this.cameraAutoUpdate=!0,this.enabled=!1,this.isPresenting=!1,this.getController=function(K){let mt=E[K];return mt===void 0&&(mt=new Qa,E[K]=mt),mt.getTargetRaySpace()},this.getControllerGrip=function(K){let mt=E[K];return mt===void 0&&(mt=new Qa,E[K]=mt),mt.getGripSpace()},this.getHand=function(K){let mt=E[K];return mt===void 0&&(mt=new Qa,E[K]=mt),mt.getHandSpace()};function $(K){const mt=T.indexOf(K.inputSource);if(mt===-1)return;const wt=E[mt];wt!==void 0&&(wt.update(K.inputSource,K.frame,c||o),wt.dispatchEvent({type:K.type,data:K.inputSource}))}function k(){s.removeEventListener("select",$),s.removeEventListener("selectstart",$),s.removeEventListener("selectend",$),s.removeEventListener("squeeze",$),s.removeEventListener("squeezestart",$),s.removeEventListener("squeezeend",$),s.removeEventListener("end",k),s.removeEventListener("inputsourceschange",tt);for(let K=0;K<E.length;K++){const mt=T[K];mt!==null&&(T[K]=null,E[K].disconnect(mt))}L=null,z=null,m.reset();for(const K in f)delete f[K];if(t.setRenderTarget(M),p=null,u=null,d=null,s=null,b=null,Nt.stop(),i.isPresenting=!1,t.setPixelRatio(S),t.setSize(v.width,v.height,!1),N!==null){const K=N.camera;K.fov=N.fov,K.zoom=N.zoom,K.updateProjectionMatrix(),N=null}i.dispatchEvent({type:"sessionend"})}this.setFramebufferScaleFactor=function(K){r=K,i.isPresenting===!0&&Dt("WebXRManager: Cannot change framebuffer scale while presenting.")},this.setReferenceSpaceType=function(K){a=K,i.isPresenting===!0&&Dt("WebXRManager: Cannot change reference space type while presenting.")},this.getReferenceSpace=function(){return c||o},this.setReferenceSpace=function(K){c=K},this.getBaseLayer=function(){return u!==null?u:p},this.getBinding=function(){return d===null&&x&&(d=new XRWebGLBinding(s,e)),d},this.getFrame=function(){return g},this.getSession=function(){return s},this.setSession=async function(K){if(s=K,s!==null){if(M=t.getRenderTarget(),s.addEventListener("select",$),s.addEventListener("selectstart",$),s.addEventListener("selectend",$),s.addEventListener("squeeze",$),s.addEventListener("squeezestart",$),s.addEventListener("squeezeend",$),s.addEventListener("end",k),s.addEventListener("inputsourceschange",tt),_.xrCompatible!==!0&&await e.makeXRCompatible(),S=t.getPixelRatio(),t.getSize(v),x&&"createProjectionLayer"in XRWebGLBinding.prototype){let wt=null,Ct=null,gt=null;_.depth&&(gt=_.stencil?e.DEPTH24_STENCIL8:e.DEPTH_COMPONENT24,wt=_.stencil?Ui:Bi,Ct=_.stencil?Ws:$n);const Ft={colorFormat:e.RGBA8,depthFormat:gt,scaleFactor:r};d=this.getBinding(),u=d.createProjectionLayer(Ft),s.updateRenderState({layers:[u]}),t.setPixelRatio(1),t.setSize(u.textureWidth,u.textureHeight,!1),b=new En(u.textureWidth,u.textureHeight,{format:Wn,type:yn,depthTexture:new Xs(u.textureWidth,u.textureHeight,Ct,void 0,void 0,void 0,void 0,void 0,void 0,wt),stencilBuffer:_.stencil,colorSpace:t.outputColorSpace,samples:_.antialias?4:0,resolveDepthBuffer:u.ignoreDepthValues===!1,resolveStencilBuffer:u.ignoreDepthValues===!1,storeMultisampledDepthBuffer:u.ignoreDepthValues===!1,storeMultisampledStencilBuffer:u.ignoreDepthValues===!1})}else{const wt={antialias:_.antialias,alpha:!0,depth:_.depth,stencil:_.stencil,framebufferScaleFactor:r};p=new XRWebGLLayer(s,e,wt),s.updateRenderState({baseLayer:p}),t.setPixelRatio(1),t.setSize(p.framebufferWidth,p.framebufferHeight,!1),b=new En(p.framebufferWidth,p.framebufferHeight,{format:Wn,type:yn,colorSpace:t.outputColorSpace,stencilBuffer:_.stencil,resolveDepthBuffer:p.ignoreDepthValues===!1,resolveStencilBuffer:p.ignoreDepthValues===!1,storeMultisampledDepthBuffer:p.ignoreDepthValues===!1,storeMultisampledStencilBuffer:p.ignoreDepthValues===!1})}b.isXRRenderTarget=!0,this.setFoveation(l),c=null,o=await s.requestReferenceSpace(a),Nt.setContext(s),Nt.start(),i.isPresenting=!0,i.dispatchEvent({type:"sessionstart"})}},this.getEnvironmentBlendMode=function(){if(s!==null)return s.environmentBlendMode},this.getDepthTexture=function(){return m.getDepthTexture()};function tt(K){for(let mt=0;mt<K.removed.length;mt++){const wt=K.removed[mt],Ct=T.indexOf(wt);Ct>=0&&(T[Ct]=null,E[Ct].disconnect(wt))}for(let mt=0;mt<K.added.length;mt++){const wt=K.added[mt];let Ct=T.indexOf(wt);if(Ct===-1){for(let Ft=0;Ft<E.length;Ft++)if(Ft>=T.length){T.push(wt),Ct=Ft;break}else if(T[Ft]===null){T[Ft]=wt,Ct=Ft;break}if(Ct===-1)break}const gt=E[Ct];gt&&gt.connect(wt)}}function W(K,mt){mt===null?K.matrixWorld.copy(K.matrix):K.matrixWorld.multiplyMatrices(mt.matrixWorld,K.matrix),K.matrixWorldInverse.copy(K.matrixWorld).invert()}this.updateCamera=function(K){if(s===null)return;let mt=K.near,wt=K.far;m.texture!==null&&(m.depthNear>0&&(mt=m.depthNear),m.depthFar>0&&(wt=m.depthFar)),F.near=U.near=P.near=mt,F.far=U.far=P.far=wt,(L!==F.near||z!==F.far)&&(s.updateRenderState({depthNear:F.near,depthFar:F.far}),L=F.near,z=F.far),F.layers.mask=K.layers.mask|6,P.layers.mask=F.layers.mask&-5,U.layers.mask=F.layers.mask&-3;const Ct=K.parent,gt=F.cameras;W(F,Ct);for(let Ft=0;Ft<gt.length;Ft++)W(gt[Ft],Ct);F.projectionMatrix.copy(P.projectionMatrix),F.projectionMatrixInverse.copy(P.projectionMatrixInverse),N===null&&K.isPerspectiveCamera&&(N={camera:K,fov:K.fov,zoom:K.zoom}),Q(K,F,Ct)};function Q(K,mt,wt){wt===null?K.matrix.copy(mt.matrixWorld):(K.matrix.copy(wt.matrixWorld),K.matrix.invert(),K.matrix.multiply(mt.matrixWorld)),K.matrix.decompose(K.position,K.quaternion,K.scale),K.updateMatrixWorld(!0),K.projectionMatrix.copy(mt.projectionMatrix),K.projectionMatrixInverse.copy(mt.projectionMatrixInverse),K.isPerspectiveCamera&&(K.fov=Ir*2*Math.atan(1/K.projectionMatrix.elements[5]),K.zoom=1)}this.getCamera=function(){return F},this.getFoveation=function(){if(!(u===null&&p===null))return l},this.setFoveation=function(K){l=K,u!==null&&(u.fixedFoveation=K),p!==null&&p.fixedFoveation!==void 0&&(p.fixedFoveation=K)},this.hasDepthSensing=function(){return m.texture!==null},this.getDepthSensingMesh=function(){return m.getMesh(F)},this.getCameraTexture=function(K){return f[K]};let et=null;function xt(K,mt){if(h=mt.getViewerPose(c||o),g=mt,h!==null){const wt=h.views;p!==null&&(t.setRenderTargetFramebuffer(b,p.framebuffer),t.setRenderTarget(b));let Ct=!1;wt.length!==F.cameras.length&&(F.cameras.length=0,Ct=!0);for(let Pt=0;Pt<wt.length;Pt++){const ie=wt[Pt];let oe=null;if(p!==null)oe=p.getViewport(ie);else{const He=d.getViewSubImage(u,ie);oe=He.viewport,Pt===0&&(t.setRenderTargetTextures(b,He.colorTexture,He.depthStencilTexture),t.setRenderTarget(b))}let Gt=D[Pt];Gt===void 0&&(Gt=new Pn,Gt.layers.enable(Pt),Gt.viewport=new Ee,D[Pt]=Gt),Gt.matrix.fromArray(ie.transform.matrix),Gt.matrix.decompose(Gt.position,Gt.quaternion,Gt.scale),Gt.projectionMatrix.fromArray(ie.projectionMatrix),Gt.projectionMatrixInverse.copy(Gt.projectionMatrix).invert(),Gt.viewport.set(oe.x,oe.y,oe.width,oe.height),Pt===0&&(F.matrix.copy(Gt.matrix),F.matrix.decompose(F.position,F.quaternion,F.scale)),Ct===!0&&F.cameras.push(Gt)}const gt=s.enabledFeatures;if(gt&&gt.includes("depth-sensing")&&s.depthUsage=="gpu-optimized"&&x){d=i.getBinding();const Pt=d.getDepthInformation(wt[0]);Pt&&Pt.isValid&&Pt.texture&&m.init(Pt,s.renderState)}if(gt&&gt.includes("camera-access")&&x){t.state.unbindTexture(),d=i.getBinding();for(let Pt=0;Pt<wt.length;Pt++){const ie=wt[Pt].camera;if(ie){let oe=f[ie];oe||(oe=new Ef,f[ie]=oe);const Gt=d.getCameraImage(ie);oe.sourceTexture=Gt}}}}for(let wt=0;wt<E.length;wt++){const Ct=T[wt],gt=E[wt];Ct!==null&&gt!==void 0&&gt.update(Ct,mt,c||o)}et&&et(K,mt),mt.detectedPlanes&&i.dispatchEvent({type:"planesdetected",data:mt}),g=null}const Nt=new Pf;Nt.setAnimationLoop(xt),this.setAnimationLoop=function(K){et=K},this.dispose=function(){}}}const Ry=new Yt,zf=new Lt;zf.set(-1,0,0,0,1,0,0,0,1);function Py(n,t){function e(m,f){m.matrixAutoUpdate===!0&&m.updateMatrix(),f.value.copy(m.matrix)}function i(m,f){f.color.getRGB(m.fogColor.value,Mf(n)),f.isFog?(m.fogNear.value=f.near,m.fogFar.value=f.far):f.isFogExp2&&(m.fogDensity.value=f.density)}function s(m,f,_,M,b){f.isNodeMaterial?f.uniformsNeedUpdate=!1:f.isMeshBasicMaterial?r(m,f):f.isMeshLambertMaterial?(r(m,f),f.envMap&&(m.envMapIntensity.value=f.envMapIntensity)):f.isMeshToonMaterial?(r(m,f),d(m,f)):f.isMeshPhongMaterial?(r(m,f),h(m,f),f.envMap&&(m.envMapIntensity.value=f.envMapIntensity)):f.isMeshStandardMaterial?(r(m,f),u(m,f),f.isMeshPhysicalMaterial&&p(m,f,b)):f.isMeshMatcapMaterial?(r(m,f),g(m,f)):f.isMeshDepthMaterial?r(m,f):f.isMeshDistanceMaterial?(r(m,f),x(m,f)):f.isMeshNormalMaterial?r(m,f):f.isLineBasicMaterial?(o(m,f),f.isLineDashedMaterial&&a(m,f)):f.isPointsMaterial?l(m,f,_,M):f.isSpriteMaterial?c(m,f):f.isShadowMaterial?(m.color.value.copy(f.color),m.opacity.value=f.opacity):f.isShaderMaterial&&(f.uniformsNeedUpdate=!1)}function r(m,f){m.opacity.value=f.opacity,f.color&&m.diffuse.value.copy(f.color),f.emissive&&m.emissive.value.copy(f.emissive).multiplyScalar(f.emissiveIntensity),f.map&&(m.map.value=f.map,e(f.map,m.mapTransform)),f.alphaMap&&(m.alphaMap.value=f.alphaMap,e(f.alphaMap,m.alphaMapTransform)),f.bumpMap&&(m.bumpMap.value=f.bumpMap,e(f.bumpMap,m.bumpMapTransform),m.bumpScale.value=f.bumpScale,f.side===an&&(m.bumpScale.value*=-1)),f.normalMap&&(m.normalMap.value=f.normalMap,e(f.normalMap,m.normalMapTransform),m.normalScale.value.copy(f.normalScale),f.side===an&&m.normalScale.value.negate()),f.displacementMap&&(m.displacementMap.value=f.displacementMap,e(f.displacementMap,m.displacementMapTransform),m.displacementScale.value=f.displacementScale,m.displacementBias.value=f.displacementBias),f.emissiveMap&&(m.emissiveMap.value=f.emissiveMap,e(f.emissiveMap,m.emissiveMapTransform)),f.specularMap&&(m.specularMap.value=f.specularMap,e(f.specularMap,m.specularMapTransform)),f.alphaTest>0&&(m.alphaTest.value=f.alphaTest);const _=t.get(f),M=_.envMap,b=_.envMapRotation;M&&(m.envMap.value=M,m.envMapRotation.value.setFromMatrix4(Ry.makeRotationFromEuler(b)).transpose(),M.isCubeTexture&&M.isRenderTargetTexture===!1&&m.envMapRotation.value.premultiply(zf),m.reflectivity.value=f.reflectivity,m.ior.value=f.ior,m.refractionRatio.value=f.refractionRatio),f.lightMap&&(m.lightMap.value=f.lightMap,m.lightMapIntensity.value=f.lightMapIntensity,e(f.lightMap,m.lightMapTransform)),f.aoMap&&(m.aoMap.value=f.aoMap,m.aoMapIntensity.value=f.aoMapIntensity,e(f.aoMap,m.aoMapTransform))}function o(m,f){m.diffuse.value.copy(f.color),m.opacity.value=f.opacity,f.map&&(m.map.value=f.map,e(f.map,m.mapTransform))}function a(m,f){m.dashSize.value=f.dashSize,m.totalSize.value=f.dashSize+f.gapSize,m.scale.value=f.scale}function l(m,f,_,M){m.diffuse.value.copy(f.color),m.opacity.value=f.opacity,m.size.value=f.size*_,m.scale.value=M*.5,f.map&&(m.map.value=f.map,e(f.map,m.uvTransform)),f.alphaMap&&(m.alphaMap.value=f.alphaMap,e(f.alphaMap,m.alphaMapTransform)),f.alphaTest>0&&(m.alphaTest.value=f.alphaTest)}function c(m,f){m.diffuse.value.copy(f.color),m.opacity.value=f.opacity,m.rotation.value=f.rotation,f.map&&(m.map.value=f.map,e(f.map,m.mapTransform)),f.alphaMap&&(m.alphaMap.value=f.alphaMap,e(f.alphaMap,m.alphaMapTransform)),f.alphaTest>0&&(m.alphaTest.value=f.alphaTest)}function h(m,f){m.specular.value.copy(f.specular),m.shininess.value=Math.max(f.shininess,1e-4)}function d(m,f){f.gradientMap&&(m.gradientMap.value=f.gradientMap)}function u(m,f){m.metalness.value=f.metalness,f.metalnessMap&&(m.metalnessMap.value=f.metalnessMap,e(f.metalnessMap,m.metalnessMapTransform)),m.roughness.value=f.roughness,f.roughnessMap&&(m.roughnessMap.value=f.roughnessMap,e(f.roughnessMap,m.roughnessMapTransform)),f.envMap&&(m.envMapIntensity.value=f.envMapIntensity)}function p(m,f,_){m.ior.value=f.ior,f.diffuseRoughness>0&&(m.diffuseRoughness.value=f.diffuseRoughness,f.diffuseRoughnessMap&&(m.diffuseRoughnessMap.value=f.diffuseRoughnessMap,e(f.diffuseRoughnessMap,m.diffuseRoughnessMapTransform))),f.sheen>0&&(m.sheenColor.value.copy(f.sheenColor).multiplyScalar(f.sheen),m.sheenRoughness.value=f.sheenRoughness,f.sheenColorMap&&(m.sheenColorMap.value=f.sheenColorMap,e(f.sheenColorMap,m.sheenColorMapTransform)),f.sheenRoughnessMap&&(m.sheenRoughnessMap.value=f.sheenRoughnessMap,e(f.sheenRoughnessMap,m.sheenRoughnessMapTransform))),f.clearcoat>0&&(m.clearcoat.value=f.clearcoat,m.clearcoatRoughness.value=f.clearcoatRoughness,f.clearcoatMap&&(m.clearcoatMap.value=f.clearcoatMap,e(f.clearcoatMap,m.clearcoatMapTransform)),f.clearcoatRoughnessMap&&(m.clearcoatRoughnessMap.value=f.clearcoatRoughnessMap,e(f.clearcoatRoughnessMap,m.clearcoatRoughnessMapTransform)),f.clearcoatNormalMap&&(m.clearcoatNormalMap.value=f.clearcoatNormalMap,e(f.clearcoatNormalMap,m.clearcoatNormalMapTransform),m.clearcoatNormalScale.value.copy(f.clearcoatNormalScale),f.side===an&&m.clearcoatNormalScale.value.negate())),f.dispersion>0&&(m.dispersion.value=f.dispersion),f.retroreflectivity>0&&(m.retroreflectivity.value=f.retroreflectivity),f.iridescence>0&&(m.iridescence.value=f.iridescence,m.iridescenceIOR.value=f.iridescenceIOR,m.iridescenceThicknessMinimum.value=f.iridescenceThicknessMinimum,m.iridescenceThicknessMaximum.value=f.iridescenceThicknessMaximum,f.iridescenceMap&&(m.iridescenceMap.value=f.iridescenceMap,e(f.iridescenceMap,m.iridescenceMapTransform)),f.iridescenceThicknessMap&&(m.iridescenceThicknessMap.value=f.iridescenceThicknessMap,e(f.iridescenceThicknessMap,m.iridescenceThicknessMapTransform))),f.transmission>0&&(m.transmission.value=f.transmission,m.transmissionSamplerMap.value=_.texture,m.transmissionSamplerSize.value.set(_.width,_.height),f.transmissionMap&&(m.transmissionMap.value=f.transmissionMap,e(f.transmissionMap,m.transmissionMapTransform)),m.thickness.value=f.thickness,f.thicknessMap&&(m.thicknessMap.value=f.thicknessMap,e(f.thicknessMap,m.thicknessMapTransform)),m.attenuationDistance.value=f.attenuationDistance,m.attenuationColor.value.copy(f.attenuationColor)),f.anisotropy>0&&(m.anisotropyVector.value.set(f.anisotropy*Math.cos(f.anisotropyRotation),f.anisotropy*Math.sin(f.anisotropyRotation)),f.anisotropyMap&&(m.anisotropyMap.value=f.anisotropyMap,e(f.anisotropyMap,m.anisotropyMapTransform))),m.specularIntensity.value=f.specularIntensity,m.specularColor.value.copy(f.specularColor),f.specularColorMap&&(m.specularColorMap.value=f.specularColorMap,e(f.specularColorMap,m.specularColorMapTransform)),f.specularIntensityMap&&(m.specularIntensityMap.value=f.specularIntensityMap,e(f.specularIntensityMap,m.specularIntensityMapTransform))}function g(m,f){f.matcap&&(m.matcap.value=f.matcap)}function x(m,f){const _=t.get(f).light;m.referencePosition.value.setFromMatrixPosition(_.matrixWorld),m.nearDistance.value=_.shadow.camera.near,m.farDistance.value=_.shadow.camera.far}return{refreshFogUniforms:i,refreshMaterialUniforms:s}}function Ly(n,t,e,i){let s={},r={};function o(_,M){const b=M.program;i.uniformBlockBinding(_,b,s[_.id])}function a(_,M){let b=s[_.id];b===void 0&&(g(_),b=l(_),s[_.id]=b,_.addEventListener("dispose",m));const E=M.program;i.updateUBOMapping(_,E);const T=t.render.frame;r[_.id]!==T&&(c(_),r[_.id]=T)}function l(_){const M=n.createBuffer(),b=_.__size,E=_.usage;return n.bindBuffer(n.UNIFORM_BUFFER,M),n.bufferData(n.UNIFORM_BUFFER,b,E),n.bindBuffer(n.UNIFORM_BUFFER,null),M}function c(_){const M=s[_.id],b=_.uniforms,E=_.__cache;n.bindBuffer(n.UNIFORM_BUFFER,M);for(let T=0,v=b.length;T<v;T++){const S=b[T];if(Array.isArray(S))for(let N=0,P=S.length;N<P;N++)h(S[N],T,N,E);else h(S,T,0,E)}n.bindBuffer(n.UNIFORM_BUFFER,null)}function h(_,M,b,E){if(u(_,M,b,E)===!0){const T=_.__offset,v=_.value;if(Array.isArray(v)){let S=0;for(let N=0;N<v.length;N++){const P=v[N],U=x(P,!0);d(P,_.__data,S),S+=U.storage/Float32Array.BYTES_PER_ELEMENT}}else d(v,_.__data,0);n.bufferSubData(n.UNIFORM_BUFFER,T,_.__data)}}function d(_,M,b){typeof _=="number"||typeof _=="boolean"?M[b]=_:_.isMatrix3?(M[b]=_.elements[0],M[b+1]=_.elements[1],M[b+2]=_.elements[2],M[b+3]=0,M[b+4]=_.elements[3],M[b+5]=_.elements[4],M[b+6]=_.elements[5],M[b+7]=0,M[b+8]=_.elements[6],M[b+9]=_.elements[7],M[b+10]=_.elements[8],M[b+11]=0):ArrayBuffer.isView(_)?M.set(_.subarray(0,M.length-b),b):_.toArray(M,b)}function u(_,M,b,E){const T=_.value,v=M+"_"+b;if(Array.isArray(T)){E[v]===void 0&&(E[v]=[]);const S=E[v];let N=!1;for(let P=0;P<T.length;P++)p(T[P],S,P)===!0&&(N=!0);return N}return p(T,E,v)}function p(_,M,b){if(M[b]===void 0)return typeof _=="number"||typeof _=="boolean"?M[b]=_:ArrayBuffer.isView(_)?M[b]=_.slice():M[b]=_.clone(),!0;{const E=M[b];if(typeof _=="number"||typeof _=="boolean"){if(E!==_)return M[b]=_,!0}else{if(ArrayBuffer.isView(_))return!0;if(E.equals(_)===!1)return E.copy(_),!0}}return!1}function g(_){const M=_.uniforms;let b=0;const E=16;for(let v=0,S=M.length;v<S;v++){const N=Array.isArray(M[v])?M[v]:[M[v]];for(let P=0,U=N.length;P<U;P++){const D=N[P],F=Array.isArray(D.value)?D.value:[D.value],L=Array.isArray(M[v])||Array.isArray(D.value);let z=b;for(let k=0,tt=F.length;k<tt;k++){const W=F[k],Q=x(W,L),et=b%E,xt=et%Q.boundary,Nt=et+xt;b+=xt,Nt!==0&&E-Nt<Q.storage&&(b+=E-Nt),k===0&&(z=b),b+=Q.storage}const $=D.type==="int"?Int32Array:D.type==="uint"?Uint32Array:Float32Array;D.__data=new $((b-z)/Float32Array.BYTES_PER_ELEMENT),D.__offset=z}}const T=b%E;return T>0&&(b+=E-T),_.__size=b,_.__cache={},this}function x(_,M){const b={boundary:0,storage:0};return typeof _=="number"||typeof _=="boolean"?(b.boundary=4,b.storage=4):_.isVector2?(b.boundary=8,b.storage=8):_.isVector3||_.isColor?(b.boundary=16,b.storage=12):_.isVector4?(b.boundary=16,b.storage=16):_.isMatrix3?(b.boundary=16,b.storage=48):_.isMatrix4?(b.boundary=16,b.storage=64):_.isTexture?Dt("WebGLRenderer: Texture samplers can not be part of an uniforms group."):ArrayBuffer.isView(_)?(b.boundary=16,b.storage=_.byteLength):Dt("WebGLRenderer: Unsupported uniform value type.",_),M===!0&&(b.boundary=16,b.storage=Math.ceil(b.storage/16)*16),b}function m(_){const M=_.target;M.removeEventListener("dispose",m),n.deleteBuffer(s[M.id]),delete s[M.id],delete r[M.id]}function f(){for(const _ in s)n.deleteBuffer(s[_]);s={},r={}}return{bind:o,update:a,dispose:f}}const Dy=new Uint16Array([12469,15057,12620,14925,13266,14620,13807,14376,14323,13990,14545,13625,14713,13328,14840,12882,14931,12528,14996,12233,15039,11829,15066,11525,15080,11295,15085,10976,15082,10705,15073,10495,13880,14564,13898,14542,13977,14430,14158,14124,14393,13732,14556,13410,14702,12996,14814,12596,14891,12291,14937,11834,14957,11489,14958,11194,14943,10803,14921,10506,14893,10278,14858,9960,14484,14039,14487,14025,14499,13941,14524,13740,14574,13468,14654,13106,14743,12678,14818,12344,14867,11893,14889,11509,14893,11180,14881,10751,14852,10428,14812,10128,14765,9754,14712,9466,14764,13480,14764,13475,14766,13440,14766,13347,14769,13070,14786,12713,14816,12387,14844,11957,14860,11549,14868,11215,14855,10751,14825,10403,14782,10044,14729,9651,14666,9352,14599,9029,14967,12835,14966,12831,14963,12804,14954,12723,14936,12564,14917,12347,14900,11958,14886,11569,14878,11247,14859,10765,14828,10401,14784,10011,14727,9600,14660,9289,14586,8893,14508,8533,15111,12234,15110,12234,15104,12216,15092,12156,15067,12010,15028,11776,14981,11500,14942,11205,14902,10752,14861,10393,14812,9991,14752,9570,14682,9252,14603,8808,14519,8445,14431,8145,15209,11449,15208,11451,15202,11451,15190,11438,15163,11384,15117,11274,15055,10979,14994,10648,14932,10343,14871,9936,14803,9532,14729,9218,14645,8742,14556,8381,14461,8020,14365,7603,15273,10603,15272,10607,15267,10619,15256,10631,15231,10614,15182,10535,15118,10389,15042,10167,14963,9787,14883,9447,14800,9115,14710,8665,14615,8318,14514,7911,14411,7507,14279,7198,15314,9675,15313,9683,15309,9712,15298,9759,15277,9797,15229,9773,15166,9668,15084,9487,14995,9274,14898,8910,14800,8539,14697,8234,14590,7790,14479,7409,14367,7067,14178,6621,15337,8619,15337,8631,15333,8677,15325,8769,15305,8871,15264,8940,15202,8909,15119,8775,15022,8565,14916,8328,14804,8009,14688,7614,14569,7287,14448,6888,14321,6483,14088,6171,15350,7402,15350,7419,15347,7480,15340,7613,15322,7804,15287,7973,15229,8057,15148,8012,15046,7846,14933,7611,14810,7357,14682,7069,14552,6656,14421,6316,14251,5948,14007,5528,15356,5942,15356,5977,15353,6119,15348,6294,15332,6551,15302,6824,15249,7044,15171,7122,15070,7050,14949,6861,14818,6611,14679,6349,14538,6067,14398,5651,14189,5311,13935,4958,15359,4123,15359,4153,15356,4296,15353,4646,15338,5160,15311,5508,15263,5829,15188,6042,15088,6094,14966,6001,14826,5796,14678,5543,14527,5287,14377,4985,14133,4586,13869,4257,15360,1563,15360,1642,15358,2076,15354,2636,15341,3350,15317,4019,15273,4429,15203,4732,15105,4911,14981,4932,14836,4818,14679,4621,14517,4386,14359,4156,14083,3795,13808,3437,15360,122,15360,137,15358,285,15355,636,15344,1274,15322,2177,15281,2765,15215,3223,15120,3451,14995,3569,14846,3567,14681,3466,14511,3305,14344,3121,14037,2800,13753,2467,15360,0,15360,1,15359,21,15355,89,15346,253,15325,479,15287,796,15225,1148,15133,1492,15008,1749,14856,1882,14685,1886,14506,1783,14324,1608,13996,1398,13702,1183]);let kn=null;function Iy(){return kn===null&&(kn=new xf(Dy,16,16,is,Yn),kn.name="DFG_LUT",kn.minFilter=tn,kn.magFilter=tn,kn.wrapS=oi,kn.wrapT=oi,kn.generateMipmaps=!1,kn.needsUpdate=!0),kn}class Ny{constructor(t={}){const{canvas:e=$0(),context:i=null,depth:s=!0,stencil:r=!1,alpha:o=!1,antialias:a=!1,premultipliedAlpha:l=!0,preserveDrawingBuffer:c=!1,powerPreference:h="default",failIfMajorPerformanceCaveat:d=!1,reversedDepthBuffer:u=!1,outputBufferType:p=yn}=t;this.isWebGLRenderer=!0;let g;if(i!==null){if(typeof WebGLRenderingContext<"u"&&i instanceof WebGLRenderingContext)throw new Error("THREE.WebGLRenderer: WebGL 1 is not supported since r163.");g=i.getContextAttributes().alpha}else g=o;const x=p,m=new Set([jc,Zc,Kc]),f=new Set([yn,$n,Dr,Ws,qc,$c]),_=new Uint32Array(4),M=new Int32Array(4),b={textures:[],min:[],max:[],resolution:[]};let E=null,T=null;const v=[],S=[];let N=null;this.domElement=e,this.debug={checkShaderErrors:!0,diagnostics:{keywords:!1},onShaderError:null},this.autoClear=!0,this.autoClearColor=!0,this.autoClearDepth=!0,this.autoClearStencil=!0,this.sortObjects=!0,this.clippingPlanes=[],this.localClippingEnabled=!1,this.toneMapping=ci,this.toneMappingExposure=1,this.transmissionResolutionScale=1;const P=this;let U=!1,D=null,F=null,L=null,z=null;this._outputColorSpace=wn;let $=0,k=0,tt=null,W=-1,Q=null;const et=new Ee,xt=new Ee;let Nt=null;const K=new Zt(0);let mt=0,wt=e.width,Ct=e.height,gt=1,Ft=null,Me=null;const Pt=new Ee(0,0,wt,Ct),ie=new Ee(0,0,wt,Ct);let oe=!1;const Gt=new da,He=new sh;let Pe=!1,sn=!1;const ve=new Yt,On=new C,Fe=new Ee,mn={background:null,fog:null,environment:null,overrideMaterial:null,isScene:!0};let gn=!1;function vn(){return tt===null?gt:1}let O=i;function _n(y,I){return e.getContext(y,I)}let de,pe,dt,Le,Rt,Ut,A,w,V,nt,J,rt,ht,Y,Z,at,R,j,q,lt,st,ot,Mt;try{const y={alpha:!0,depth:s,stencil:r,antialias:a,premultipliedAlpha:l,preserveDrawingBuffer:c,powerPreference:h,failIfMajorPerformanceCaveat:d};if("setAttribute"in e&&e.setAttribute("data-engine","three.js r187"),e.addEventListener("webglcontextlost",Tt,!1),e.addEventListener("webglcontextrestored",kt,!1),e.addEventListener("webglcontextcreationerror",pt,!1),O===null){const I="webgl2";if(O=_n(I,y),O===null)throw _n(I)?new Error("THREE.WebGLRenderer: Error creating WebGL context with your selected attributes."):new Error("THREE.WebGLRenderer: Error creating WebGL context.")}Bt()}catch(y){throw e.removeEventListener("webglcontextlost",Tt,!1),e.removeEventListener("webglcontextrestored",kt,!1),e.removeEventListener("webglcontextcreationerror",pt,!1),Qt("WebGLRenderer: "+y.message),y}function Bt(){de=new Fb(O),de.init(),st=new Ey(O,de),pe=new Tb(O,de,t,st),dt=new yy(O,de),pe.reversedDepthBuffer&&u&&dt.buffers.depth.setReversed(!0),F=O.createFramebuffer(),L=O.createFramebuffer(),z=O.createFramebuffer(),Le=new zb(O),Rt=new ly,Ut=new Sy(O,de,dt,Rt,pe,st,Le),A=new Ob(P),w=new Hv(O),ot=new Eb(O,w),V=new kb(O,w,Le,ot),nt=new Hb(O,V,w,ot,Le),j=new Vb(O,pe,Ut),Z=new Ab(Rt),J=new ay(P,A,de,pe,ot,Z),rt=new Py(P,Rt),ht=new hy,Y=new gy(de),R=new Sb(P,A,dt,nt,g,l),at=new wy(P,nt,pe),Mt=new Ly(O,Le,pe,dt),q=new Mb(O,de,Le),lt=new Bb(O,de,Le),Le.programs=J.programs,P.capabilities=pe,P.extensions=de,P.properties=Rt,P.renderLists=ht,P.shadowMap=at,P.state=dt,P.info=Le}x!==yn&&(N=new Wb(x,e.width,e.height,a,s,r));const it=new Cy(P,O);this.xr=it,this.getContext=function(){return O},this.getContextAttributes=function(){return O.getContextAttributes()},this.forceContextLoss=function(){const y=de.get("WEBGL_lose_context");y&&y.loseContext()},this.forceContextRestore=function(){const y=de.get("WEBGL_lose_context");y&&y.restoreContext()},this.getPixelRatio=function(){return gt},this.setPixelRatio=function(y){y!==void 0&&(gt=y,this.setSize(wt,Ct,!1))},this.getSize=function(y){return y.set(wt,Ct)},this.setSize=function(y,I,X=!0){if(it.isPresenting){Dt("WebGLRenderer: Can't change size while VR device is presenting.");return}wt=y,Ct=I,e.width=Math.floor(y*gt),e.height=Math.floor(I*gt),X===!0&&(e.style.width=y+"px",e.style.height=I+"px"),N!==null&&N.setSize(e.width,e.height),this.setViewport(0,0,y,I)},this.getDrawingBufferSize=function(y){return y.set(wt*gt,Ct*gt).floor()},this.setDrawingBufferSize=function(y,I,X){wt=y,Ct=I,gt=X,e.width=Math.floor(y*X),e.height=Math.floor(I*X),this.setViewport(0,0,y,I)},this.setEffects=function(y){if(x===yn){Qt("WebGLRenderer: setEffects() requires outputBufferType set to HalfFloatType or FloatType.");return}if(y){for(let I=0;I<y.length;I++)if(y[I].isOutputPass===!0){Dt("WebGLRenderer: OutputPass is not needed in setEffects(). Tone mapping and color space conversion are applied automatically.");break}}N.setEffects(y||[])},this.getCurrentViewport=function(y){return y.copy(et)},this.getViewport=function(y){return y.copy(Pt)},this.setViewport=function(y,I,X,B){y.isVector4?Pt.set(y.x,y.y,y.z,y.w):Pt.set(y,I,X,B),dt.viewport(et.copy(Pt).multiplyScalar(vn()).round())},this.getScissor=function(y){return y.copy(ie)},this.setScissor=function(y,I,X,B){y.isVector4?ie.set(y.x,y.y,y.z,y.w):ie.set(y,I,X,B),dt.scissor(xt.copy(ie).multiplyScalar(vn()).round())},this.getScissorTest=function(){return oe},this.setScissorTest=function(y){dt.setScissorTest(oe=y)},this.setOpaqueSort=function(y){Ft=y},this.setTransparentSort=function(y){Me=y},this.getClearColor=function(y){return y.copy(R.getClearColor())},this.setClearColor=function(){R.setClearColor(...arguments)},this.getClearAlpha=function(){return R.getClearAlpha()},this.setClearAlpha=function(){R.setClearAlpha(...arguments)},this.clear=function(y=!0,I=!0,X=!0){let B=0;if(y){let H=!1;if(tt!==null){const ut=tt.texture.format;H=m.has(ut)}if(H){const ut=tt.texture.type,bt=f.has(ut),ct=R.getClearColor(),vt=R.getClearAlpha(),Et=ct.r,Ot=ct.g,Wt=ct.b;bt?(_[0]=Et,_[1]=Ot,_[2]=Wt,_[3]=vt,O.clearBufferuiv(O.COLOR,0,_)):(M[0]=Et,M[1]=Ot,M[2]=Wt,M[3]=vt,O.clearBufferiv(O.COLOR,0,M))}else B|=O.COLOR_BUFFER_BIT}I&&(B|=O.DEPTH_BUFFER_BIT,this.state.buffers.depth.setMask(!0)),X&&(B|=O.STENCIL_BUFFER_BIT,this.state.buffers.stencil.setMask(4294967295)),B!==0&&O.clear(B)},this.clearColor=function(){this.clear(!0,!1,!1)},this.clearDepth=function(){this.clear(!1,!0,!1)},this.clearStencil=function(){this.clear(!1,!1,!0)},this.setNodesHandler=function(y){y.setRenderer(this),D=y},this.dispose=function(){e.removeEventListener("webglcontextlost",Tt,!1),e.removeEventListener("webglcontextrestored",kt,!1),e.removeEventListener("webglcontextcreationerror",pt,!1),R.dispose(),ht.dispose(),Y.dispose(),Ut.dispose(),Rt.dispose(),A.dispose(),nt.dispose(),V.dispose(),ot.dispose(),Mt.dispose(),J.dispose(),it.dispose(),it.removeEventListener("sessionstart",nu),it.removeEventListener("sessionend",iu),Wi.stop()};function Tt(y){y.preventDefault(),_u("WebGLRenderer: Context Lost."),U=!0}function kt(){_u("WebGLRenderer: Context Restored."),U=!1;const y=Le.autoReset,I=at.enabled,X=at.autoUpdate,B=at.needsUpdate,H=at.type;Bt(),Le.autoReset=y,at.enabled=I,at.autoUpdate=X,at.needsUpdate=B,at.type=H}function pt(y){Qt("WebGLRenderer: A WebGL context could not be created. Reason: ",y.statusMessage)}function se(y){const I=y.target;I.removeEventListener("dispose",se),ke(I)}function ke(y){bi(y),Rt.remove(y)}function bi(y){const I=Rt.get(y).programs;I!==void 0&&(I.forEach(function(X){J.releaseProgram(X)}),y.isShaderMaterial&&J.releaseShaderCache(y))}this.renderBufferDirect=function(y,I,X,B,H,ut){I===null&&(I=mn);const bt=H.isMesh&&H.matrixWorld.determinantAffine()<0,ct=p0(y,I,X,B,H);dt.setMaterial(B,bt);let vt=X.index,Et=1;if(B.wireframe===!0){if(vt=V.getWireframeAttribute(X),vt===void 0)return;Et=2}const Ot=X.drawRange,Wt=X.attributes.position;let yt=Ot.start*Et,Xt=(Ot.start+Ot.count)*Et;ut!==null&&(yt=Math.max(yt,ut.start*Et),Xt=Math.min(Xt,(ut.start+ut.count)*Et)),vt!==null?(yt=Math.max(yt,0),Xt=Math.min(Xt,vt.count)):Wt!=null&&(yt=Math.max(yt,0),Xt=Math.min(Xt,Wt.count));const Te=Xt-yt;if(Te<0||Te===1/0)return;ot.setup(H,B,ct,X,vt);let he,ae=q;if(vt!==null&&(he=w.get(vt),ae=lt,ae.setIndex(he)),H.isMesh)B.wireframe===!0?(dt.setLineWidth(B.wireframeLinewidth*vn()),ae.setMode(O.LINES)):ae.setMode(O.TRIANGLES);else if(H.isLine){let qe=B.linewidth;qe===void 0&&(qe=1),dt.setLineWidth(qe*vn()),H.isLineSegments?ae.setMode(O.LINES):H.isLineLoop?ae.setMode(O.LINE_LOOP):ae.setMode(O.LINE_STRIP)}else H.isPoints?ae.setMode(O.POINTS):H.isSprite&&ae.setMode(O.TRIANGLES);if(H.isBatchedMesh)if(de.get("WEBGL_multi_draw"))ae.renderMultiDraw(H._multiDrawStarts,H._multiDrawCounts,H._multiDrawCount);else{const qe=H._multiDrawStarts,St=H._multiDrawCounts,Qe=H._multiDrawCount,te=vt?w.get(vt).bytesPerElement:1,Xi=Rt.get(B).currentProgram.getUniforms();for(let $e=0;$e<Qe;$e++)Xi.setValue(O,"_gl_DrawID",$e),ae.render(qe[$e]/te,St[$e])}else if(H.isInstancedMesh)ae.renderInstances(yt,Te,H.count);else if(X.isInstancedBufferGeometry){const qe=X._maxInstanceCount!==void 0?X._maxInstanceCount:1/0,St=Math.min(X.instanceCount,qe);ae.renderInstances(yt,Te,St)}else ae.render(yt,Te)};function eu(y,I,X,B){D!==null&&y.isNodeMaterial&&D.setObject(B,y),Pe===!0&&Z.setState(y,X,!1),y.transparent===!0&&y.side===Gn&&y.forceSinglePass===!1?(y.side=an,y.needsUpdate=!0,rr(y,I,B),y.side=ns,y.needsUpdate=!0,rr(y,I,B),y.side=Gn):rr(y,I,B)}this.compile=function(y,I,X=null){X===null&&(X=y),D!==null&&D.renderStart(y,I,X),T=Y.get(X),T.init(I),S.push(T),X.traverseVisible(function(H){H.isLight&&H.layers.test(I.layers)&&(T.pushLight(H),H.castShadow&&T.pushShadow(H))}),y!==X&&y.traverseVisible(function(H){H.isLight&&H.layers.test(I.layers)&&(T.pushLight(H),H.castShadow&&T.pushShadow(H))}),T.setupLights(),D!==null&&D.updateLights(T.state.lightsArray),sn=this.localClippingEnabled,Pe=Z.init(this.clippingPlanes,sn),Pe===!0&&Z.setGlobalState(this.clippingPlanes,I),D!==null&&at.render(T.state.shadowsArray,X,I);const B=new Set;return y.traverse(function(H){if(!(H.isMesh||H.isPoints||H.isLine||H.isSprite))return;const ut=H.material;if(ut)if(Array.isArray(ut))for(let bt=0;bt<ut.length;bt++){const ct=ut[bt];eu(ct,X,I,H),B.add(ct)}else eu(ut,X,I,H),B.add(ut)}),T=S.pop(),D!==null&&D.renderEnd(),B},this.compileAsync=function(y,I,X=null){const B=this.compile(y,I,X);return new Promise(H=>{function ut(){if(B.forEach(function(bt){const vt=Rt.get(bt).currentProgram;(vt===void 0||vt.isReady())&&B.delete(bt)}),B.size===0){H(y);return}setTimeout(ut,10)}de.get("KHR_parallel_shader_compile")!==null?ut():setTimeout(ut,10)})};let Va=null;function u0(y){Va&&Va(y)}function nu(){Wi.stop()}function iu(){Wi.start()}const Wi=new Pf;Wi.setAnimationLoop(u0),typeof self<"u"&&Wi.setContext(self),this.setAnimationLoop=function(y){Va=y,it.setAnimationLoop(y),y===null?Wi.stop():Wi.start()},it.addEventListener("sessionstart",nu),it.addEventListener("sessionend",iu),this.render=function(y,I){if(I!==void 0&&I.isCamera!==!0){Qt("WebGLRenderer.render: camera is not an instance of THREE.Camera.");return}if(U===!0)return;D!==null&&D.renderStart(y,I);const X=it.enabled===!0&&it.isPresenting===!0,B=N!==null&&(tt===null||X)&&N.begin(P,tt);if(y.matrixWorldAutoUpdate===!0&&y.updateMatrixWorld(),I.parent===null&&I.matrixWorldAutoUpdate===!0&&I.updateMatrixWorld(),it.enabled===!0&&it.isPresenting===!0&&(N===null||N.isCompositing()===!1)&&(it.cameraAutoUpdate===!0&&it.updateCamera(I),I=it.getCamera()),y.isScene===!0&&y.onBeforeRender(P,y,I,tt),T=Y.get(y,S.length),T.init(I),T.state.textureUnits=Ut.getTextureUnits(),S.push(T),ve.multiplyMatrices(I.projectionMatrix,I.matrixWorldInverse),I.isArrayCamera?He.setFromArrayCamera(I):Gt.setFromProjectionMatrix(ve,Un,I.reversedDepth),sn=this.localClippingEnabled,Pe=Z.init(this.clippingPlanes,sn),E=ht.get(y,v.length),E.init(),v.push(E),this.info.render.frame++,it.enabled===!0&&it.isPresenting===!0){const bt=P.xr.getDepthSensingMesh();bt!==null&&Ha(bt,I,-1/0,P.sortObjects)}Ha(y,I,0,P.sortObjects),E.finish(),D!==null&&D.updateLights(T.state.lightsArray),P.sortObjects===!0&&E.sort(Ft,Me),gn=it.enabled===!1||it.isPresenting===!1||it.hasDepthSensing()===!1,gn&&R.addToRenderList(E,y),this.info.autoReset===!0&&this.info.reset(),Pe===!0&&Z.beginShadows();const H=T.state.shadowsArray;if(at.render(H,y,I),Pe===!0&&Z.endShadows(),(B&&N.hasRenderPass())===!1){const bt=E.opaque,ct=E.transmissive;if(T.setupLights(),I.isArrayCamera){const vt=I.cameras;if(ct.length>0)for(let Et=0,Ot=vt.length;Et<Ot;Et++){const Wt=vt[Et];ru(bt,ct,y,Wt)}gn&&R.render(y);for(let Et=0,Ot=vt.length;Et<Ot;Et++){const Wt=vt[Et];su(E,y,Wt,Wt.viewport)}}else ct.length>0&&ru(bt,ct,y,I),gn&&R.render(y),su(E,y,I)}tt!==null&&k===0&&(Ut.updateMultisampleRenderTarget(tt),Ut.updateRenderTargetMipmap(tt)),B&&N.end(P),y.isScene===!0&&y.onAfterRender(P,y,I),ot.resetDefaultState(),W=-1,Q=null,S.pop(),S.length>0?(T=S[S.length-1],Ut.setTextureUnits(T.state.textureUnits),Pe===!0&&Z.setGlobalState(P.clippingPlanes,T.state.camera)):T=null,v.pop(),v.length>0?E=v[v.length-1]:E=null,D!==null&&D.renderEnd()};function Ha(y,I,X,B){if(y.visible===!1)return;if(y.layers.test(I.layers)){if(y.isGroup)X=y.renderOrder;else if(y.isLOD)y.autoUpdate===!0&&y.update(I);else if(y.isLight)T.pushLight(y),y.castShadow&&T.pushShadow(y);else if(y.isSprite){const bt=I.isArrayCamera?He:Gt;if(!y.frustumCulled||y.intersectsFrustum(bt)){B&&Fe.setFromMatrixPosition(y.matrixWorld).applyMatrix4(ve);const ct=nt.update(y),vt=y.material;vt.visible&&E.push(y,ct,vt,X,Fe.z,null,I)}}else if(y.isMesh||y.isLine||y.isPoints){const bt=I.isArrayCamera?He:Gt;if(!y.frustumCulled||y.intersectsFrustum(bt)){const ct=nt.update(y),vt=y.material;if(B&&(y.boundingSphere!==void 0?(y.boundingSphere===null&&y.computeBoundingSphere(),Fe.copy(y.boundingSphere.center)):(ct.boundingSphere===null&&ct.computeBoundingSphere(),Fe.copy(ct.boundingSphere.center)),Fe.applyMatrix4(y.matrixWorld).applyMatrix4(ve)),Array.isArray(vt)){const Et=ct.groups;for(let Ot=0,Wt=Et.length;Ot<Wt;Ot++){const yt=Et[Ot],Xt=vt[yt.materialIndex];Xt&&Xt.visible&&E.push(y,ct,Xt,X,Fe.z,yt,I)}}else vt.visible&&E.push(y,ct,vt,X,Fe.z,null,I)}}}const ut=y.children;for(let bt=0,ct=ut.length;bt<ct;bt++)Ha(ut[bt],I,X,B)}function su(y,I,X,B){const{opaque:H,transmissive:ut,transparent:bt}=y;T.setupLightsView(X),Pe===!0&&Z.setGlobalState(P.clippingPlanes,X),B&&dt.viewport(et.copy(B)),H.length>0&&ao(H,I,X),ut.length>0&&ao(ut,I,X),bt.length>0&&ao(bt,I,X),dt.buffers.depth.setTest(!0),dt.buffers.depth.setMask(!0),dt.buffers.color.setMask(!0),dt.setPolygonOffset(!1)}function ru(y,I,X,B){if((X.isScene===!0?X.overrideMaterial:null)!==null)return;if(T.state.transmissionRenderTarget[B.id]===void 0){const yt=de.has("EXT_color_buffer_half_float")||de.has("EXT_color_buffer_float");T.state.transmissionRenderTarget[B.id]=new En(1,1,{generateMipmaps:!0,type:yt?Yn:yn,minFilter:Ni,samples:Math.max(4,pe.samples),stencilBuffer:r,resolveDepthBuffer:!1,resolveStencilBuffer:!1,storeMultisampledDepthBuffer:!1,storeMultisampledStencilBuffer:!1,colorSpace:qt.workingColorSpace})}const ut=T.state.transmissionRenderTarget[B.id],bt=B.viewport||et;ut.setSize(bt.z*P.transmissionResolutionScale,bt.w*P.transmissionResolutionScale);const ct=P.getRenderTarget(),vt=P.getActiveCubeFace(),Et=P.getActiveMipmapLevel();P.setRenderTarget(ut),P.getClearColor(K),mt=P.getClearAlpha(),mt<1&&P.setClearColor(16777215,.5),P.clear(),gn&&R.render(X);const Ot=P.toneMapping;P.toneMapping=ci;const Wt=B.viewport;if(B.viewport!==void 0&&(B.viewport=void 0),T.setupLightsView(B),Pe===!0&&Z.setGlobalState(P.clippingPlanes,B),ao(y,X,B),Ut.updateMultisampleRenderTarget(ut),Ut.updateRenderTargetMipmap(ut),de.has("WEBGL_multisampled_render_to_texture")===!1){let yt=!1;for(let Xt=0,Te=I.length;Xt<Te;Xt++){const he=I[Xt],{object:ae,geometry:qe,material:St,group:Qe}=he;if(St.side===Gn&&ae.layers.test(B.layers)){const te=St.side;St.side=an,St.needsUpdate=!0,ou(ae,X,B,qe,St,Qe),St.side=te,St.needsUpdate=!0,yt=!0}}yt===!0&&(Ut.updateMultisampleRenderTarget(ut),Ut.updateRenderTargetMipmap(ut))}P.setRenderTarget(ct,vt,Et),P.setClearColor(K,mt),Wt!==void 0&&(B.viewport=Wt),P.toneMapping=Ot}function ao(y,I,X){const B=I.isScene===!0?I.overrideMaterial:null;for(let H=0,ut=y.length;H<ut;H++){const bt=y[H],{object:ct,geometry:vt,group:Et}=bt;let Ot=bt.material;Ot.allowOverride===!0&&B!==null&&(Ot=B),ct.layers.test(X.layers)&&ou(ct,I,X,vt,Ot,Et)}}function ou(y,I,X,B,H,ut){D!==null&&H.isNodeMaterial&&D.setObject(y,H),y.onBeforeRender(P,I,X,B,H,ut),y.modelViewMatrix.multiplyMatrices(X.matrixWorldInverse,y.matrixWorld),y.normalMatrix.getNormalMatrix(y.modelViewMatrix),H.onBeforeRender(P,I,X,B,y,ut),H.transparent===!0&&H.side===Gn&&H.forceSinglePass===!1?(H.side=an,H.needsUpdate=!0,P.renderBufferDirect(X,I,B,H,y,ut),H.side=ns,H.needsUpdate=!0,P.renderBufferDirect(X,I,B,H,y,ut),H.side=Gn):P.renderBufferDirect(X,I,B,H,y,ut),y.onAfterRender(P,I,X,B,H,ut)}function au(y){let I=0;for(const X of y)X.texture!==null&&I++;return I}function rr(y,I,X){I.isScene!==!0&&(I=mn);const B=Rt.get(y),H=T.state.lights,ut=T.state.shadowsArray,bt=H.state.version,ct=J.getParameters(y,H.state,ut,I,X,T.state.lightProbeGridArray),vt=J.getProgramCacheKey(ct);let Et=B.programs;B.environment=y.isMeshStandardMaterial||y.isMeshLambertMaterial||y.isMeshPhongMaterial?I.environment:null,B.fog=I.fog;const Ot=y.isMeshStandardMaterial||y.isMeshLambertMaterial&&!y.envMap||y.isMeshPhongMaterial&&!y.envMap;B.envMap=A.get(y.envMap||B.environment,Ot),B.envMapRotation=B.environment!==null&&y.envMap===null?I.environmentRotation:y.envMapRotation,Et===void 0&&(y.addEventListener("dispose",se),Et=new Map,B.programs=Et,B.programVariants=new Map);let Wt=Et.get(vt);if(Wt!==void 0){if(B.currentProgram===Wt&&B.lightsStateVersion===bt)return cu(y,ct),Wt}else ct.uniforms=J.getUniforms(y),D!==null&&y.isNodeMaterial&&D.build(y,X,ct),y.onBeforeCompile(ct,P),Wt=J.acquireProgram(ct,vt),Et.set(vt,Wt),B.uniforms=ct.uniforms;const yt=B.uniforms;return(!y.isShaderMaterial&&!y.isRawShaderMaterial||y.clipping===!0)&&(yt.clippingPlanes=Z.uniform),cu(y,ct),B.needsLights=m0(y),B.lightsStateVersion=bt,B.needsLights&&(yt.ambientLightColor.value=H.state.ambient,yt.lightProbe.value=H.state.probe,yt.sunLights.value=H.state.sun,yt.sunLightShadows.value=H.state.sunShadow,yt.directionalLights.value=H.state.directional,yt.directionalLightShadows.value=H.state.directionalShadow,yt.spotLights.value=H.state.spot,yt.spotLightShadows.value=H.state.spotShadow,yt.rectAreaLights.value=H.state.rectArea,yt.ltc_1.value=H.state.rectAreaLTC1,yt.ltc_2.value=H.state.rectAreaLTC2,yt.pointLights.value=H.state.point,yt.pointLightShadows.value=H.state.pointShadow,yt.hemisphereLights.value=H.state.hemi,yt.sunShadowMatrix.value=H.state.sunShadowMatrix,yt.sunShadowCascade.value=H.state.sunShadowCascade,yt.directionalShadowMatrix.value=H.state.directionalShadowMatrix,yt.spotLightMatrix.value=H.state.spotLightMatrix,yt.spotLightMap.value=H.state.spotLightMap,yt.pointShadowMatrix.value=H.state.pointShadowMatrix),B.numLightProbeGrids=au(T.state.lightProbeGridArray),B.currentProgram=Wt,B.uniformsList=null,Wt}function d0(y,I,X,B,H){const ut=Rt.get(y),bt=ut.currentProgram.id+","+B+","+H;let ct=ut.programVariants.get(bt);return ct===void 0?(ct=rr(y,I,X),ut.programVariants.set(bt,ct)):(ut.currentProgram=ct,ut.uniformsList=null,ut.outputColorSpace=B,ut.toneMapping=H),ct}function lu(y){if(y.uniformsList===null){const I=y.currentProgram.getUniforms();y.uniformsList=Jo.seqWithValue(I.seq,y.uniforms)}return y.uniformsList}function cu(y,I){const X=Rt.get(y);X.outputColorSpace=I.outputColorSpace,X.batching=I.batching,X.batchingColor=I.batchingColor,X.instancing=I.instancing,X.instancingColor=I.instancingColor,X.instancingMorph=I.instancingMorph,X.skinning=I.skinning,X.morphTargets=I.morphTargets,X.morphNormals=I.morphNormals,X.morphColors=I.morphColors,X.morphTargetsCount=I.morphTargetsCount,X.numClippingPlanes=I.numClippingPlanes,X.numIntersection=I.numClipIntersection,X.vertexAlphas=I.vertexAlphas,X.vertexTangents=I.vertexTangents,X.toneMapping=I.toneMapping}function p0(y,I,X,B,H){I.isScene!==!0&&(I=mn),Ut.resetTextureUnits();const ut=I.fog,bt=B.isMeshStandardMaterial||B.isMeshLambertMaterial||B.isMeshPhongMaterial?I.environment:null,ct=tt===null?P.outputColorSpace:tt.isXRRenderTarget===!0?tt.texture.colorSpace:qt.workingColorSpace,vt=B.isMeshStandardMaterial||B.isMeshLambertMaterial&&!B.envMap||B.isMeshPhongMaterial&&!B.envMap,Et=A.get(B.envMap||bt,vt),Ot=B.vertexColors===!0&&!!X.attributes.color&&X.attributes.color.itemSize===4,Wt=!!X.attributes.tangent&&(!!B.normalMap||B.anisotropy>0),yt=!!X.morphAttributes.position,Xt=!!X.morphAttributes.normal,Te=!!X.morphAttributes.color;let he=ci;B.toneMapped&&(tt===null||tt.isXRRenderTarget===!0)&&(he=P.toneMapping);const ae=X.morphAttributes.position||X.morphAttributes.normal||X.morphAttributes.color,qe=ae!==void 0?ae.length:0,St=Rt.get(B),Qe=T.state.lights;if(Pe===!0&&(sn===!0||y!==Q)){const _e=y===Q&&B.id===W;Z.setState(B,y,_e)}let te=!1,Xi=!1;B.version===St.__version?St.needsLights&&St.lightsStateVersion!==Qe.state.version||H.isBatchedMesh&&St.batching===!1||!H.isBatchedMesh&&St.batching===!0||H.isBatchedMesh&&St.batchingColor===!0&&H._colorsTexture===null||H.isBatchedMesh&&St.batchingColor===!1&&H._colorsTexture!==null||H.isInstancedMesh&&St.instancing===!1||!H.isInstancedMesh&&St.instancing===!0||H.isSkinnedMesh&&St.skinning===!1||!H.isSkinnedMesh&&St.skinning===!0||H.isInstancedMesh&&St.instancingColor===!0&&H.instanceColor===null||H.isInstancedMesh&&St.instancingColor===!1&&H.instanceColor!==null||H.isInstancedMesh&&St.instancingMorph===!0&&H.morphTexture===null||H.isInstancedMesh&&St.instancingMorph===!1&&H.morphTexture!==null||St.envMap!==Et||B.fog===!0&&St.fog!==ut||St.numClippingPlanes!==void 0&&(St.numClippingPlanes!==Z.numPlanes||St.numIntersection!==Z.numIntersection)||St.vertexAlphas!==Ot||St.vertexTangents!==Wt||St.morphTargets!==yt||St.morphNormals!==Xt||St.morphColors!==Te||St.morphTargetsCount!==qe||St.numLightProbeGrids!==au(T.state.lightProbeGridArray)?te=!0:(St.outputColorSpace!==ct||St.toneMapping!==he)&&(Xi=!0):(te=!0,St.__version=B.version);let $e=St.currentProgram;(te===!0||Xi===!0)&&($e=Xi===!0?d0(B,I,H,ct,he):rr(B,I,H),D&&B.isNodeMaterial&&D.onUpdateProgram(B,$e,St));let lo=!1,wi=!1,qi=!1;const Kt=$e.getUniforms(),Ge=St.uniforms;if(dt.useProgram($e.program)&&(lo=!0,wi=!0,qi=!0),B.id!==W&&(W=B.id,wi=!0),lo||Q!==y){dt.buffers.depth.getReversed()&&y.reversedDepth!==!0&&(y._reversedDepth=!0,y.updateProjectionMatrix()),Kt.setValue(O,"projectionMatrix",y.projectionMatrix),Kt.setValue(O,"viewMatrix",y.matrixWorldInverse);const Be=Kt.map.cameraPosition;Be!==void 0&&Be.setValue(O,On.setFromMatrixPosition(y.matrixWorld)),pe.logarithmicDepthBuffer&&Kt.setValue(O,"logDepthBufFC",2/(Math.log(y.far+1)/Math.LN2)),(B.isMeshPhongMaterial||B.isMeshToonMaterial||B.isMeshLambertMaterial||B.isMeshBasicMaterial||B.isMeshStandardMaterial||B.isShaderMaterial)&&Kt.setValue(O,"isOrthographic",y.isOrthographicCamera===!0),Q!==y&&(Q=y,wi=!0,qi=!0)}if(St.needsLights&&(Qe.state.sunShadowMap.length>0&&Kt.setValue(O,"sunShadowMap",Qe.state.sunShadowMap,Ut),Qe.state.directionalShadowMap.length>0&&Kt.setValue(O,"directionalShadowMap",Qe.state.directionalShadowMap,Ut),Qe.state.spotShadowMap.length>0&&Kt.setValue(O,"spotShadowMap",Qe.state.spotShadowMap,Ut),Qe.state.pointShadowMap.length>0&&Kt.setValue(O,"pointShadowMap",Qe.state.pointShadowMap,Ut)),H.isSkinnedMesh){Kt.setOptional(O,H,"bindMatrix"),Kt.setOptional(O,H,"bindMatrixInverse");const _e=H.skeleton;_e&&(_e.boneTexture===null&&_e.computeBoneTexture(),Kt.setValue(O,"boneTexture",_e.boneTexture,Ut))}H.isBatchedMesh&&(Kt.setOptional(O,H,"batchingTexture"),Kt.setValue(O,"batchingTexture",H._matricesTexture,Ut),Kt.setOptional(O,H,"batchingIdTexture"),Kt.setValue(O,"batchingIdTexture",H._indirectTexture,Ut),Kt.setOptional(O,H,"batchingColorTexture"),H._colorsTexture!==null&&Kt.setValue(O,"batchingColorTexture",H._colorsTexture,Ut));const Tn=X.morphAttributes;if((Tn.position!==void 0||Tn.normal!==void 0||Tn.color!==void 0)&&j.update(H,X,$e),(wi||St.receiveShadow!==H.receiveShadow)&&(St.receiveShadow=H.receiveShadow,Kt.setValue(O,"receiveShadow",H.receiveShadow)),(B.isMeshStandardMaterial||B.isMeshLambertMaterial||B.isMeshPhongMaterial)&&B.envMap===null&&I.environment!==null&&(Ge.envMapIntensity.value=I.environmentIntensity),Ge.dfgLUT!==void 0&&(Ge.dfgLUT.value=Iy()),wi){if(Kt.setValue(O,"toneMappingExposure",P.toneMappingExposure),St.needsLights&&f0(Ge,qi),ut&&B.fog===!0&&rt.refreshFogUniforms(Ge,ut),rt.refreshMaterialUniforms(Ge,B,gt,Ct,T.state.transmissionRenderTarget[y.id]),St.needsLights&&St.numLightProbeGrids>0){const _e=b;let Be=0;for(const Jn of T.state.lightProbeGridArray)Jn.texture!==null&&(_e.textures[Be]=Jn.texture,_e.min[Be]=Jn.boundingBox.min,_e.max[Be]=Jn.boundingBox.max,_e.resolution[Be]=Jn.resolution,Be++);for(const Jn in _e)_e[Jn].length=Be;Ge.probesSH.value=_e.textures,Ge.probesMin.value=_e.min,Ge.probesMax.value=_e.max,Ge.probesResolution.value=_e.resolution}Jo.upload(O,lu(St),Ge,Ut)}if(B.isShaderMaterial&&B.uniformsNeedUpdate===!0&&(Jo.upload(O,lu(St),Ge,Ut),B.uniformsNeedUpdate=!1),B.isSpriteMaterial&&Kt.setValue(O,"center",H.center),Kt.setValue(O,"modelViewMatrix",H.modelViewMatrix),Kt.setValue(O,"normalMatrix",H.normalMatrix),Kt.setValue(O,"modelMatrix",H.matrixWorld),B.uniformsGroups!==void 0){const _e=B.uniformsGroups;for(let Be=0,Jn=_e.length;Be<Jn;Be++){const uu=_e[Be];Mt.update(uu,$e),Mt.bind(uu,$e)}}return $e}function f0(y,I){y.ambientLightColor.needsUpdate=I,y.lightProbe.needsUpdate=I,y.sunLights.needsUpdate=I,y.sunLightShadows.needsUpdate=I,y.directionalLights.needsUpdate=I,y.directionalLightShadows.needsUpdate=I,y.pointLights.needsUpdate=I,y.pointLightShadows.needsUpdate=I,y.spotLights.needsUpdate=I,y.spotLightShadows.needsUpdate=I,y.rectAreaLights.needsUpdate=I,y.hemisphereLights.needsUpdate=I}function m0(y){return y.isMeshLambertMaterial||y.isMeshToonMaterial||y.isMeshPhongMaterial||y.isMeshStandardMaterial||y.isShadowMaterial||y.isShaderMaterial&&y.lights===!0}this.getActiveCubeFace=function(){return $},this.getActiveMipmapLevel=function(){return k},this.getRenderTarget=function(){return tt},this.setRenderTargetTextures=function(y,I,X){const B=Rt.get(y);B.__autoAllocateDepthBuffer=y.resolveDepthBuffer===!1,B.__autoAllocateDepthBuffer===!1&&(B.__useRenderToTexture=!1),Rt.get(y.texture).__webglTexture=I,Rt.get(y.depthTexture).__webglTexture=B.__autoAllocateDepthBuffer?void 0:X,B.__hasExternalTextures=!0},this.setRenderTargetFramebuffer=function(y,I){const X=Rt.get(y);X.__webglFramebuffer=I,X.__useDefaultFramebuffer=I===void 0},this.setRenderTarget=function(y,I=0,X=0){tt=y,$=I,k=X;let B=null,H=!1,ut=!1;if(y){const ct=Rt.get(y);if(ct.__useDefaultFramebuffer!==void 0){dt.bindFramebuffer(O.FRAMEBUFFER,ct.__webglFramebuffer),et.copy(y.viewport),xt.copy(y.scissor),Nt=y.scissorTest,dt.viewport(et),dt.scissor(xt),dt.setScissorTest(Nt),W=-1;return}else if(ct.__webglFramebuffer===void 0)Ut.setupRenderTarget(y);else if(ct.__hasExternalTextures)Ut.rebindTextures(y,Rt.get(y.texture).__webglTexture,Rt.get(y.depthTexture).__webglTexture);else if(y.depthBuffer){const Ot=y.depthTexture;if(ct.__boundDepthTexture!==Ot){if(Ot!==null&&Rt.has(Ot)&&(y.width!==Ot.image.width||y.height!==Ot.image.height))throw new Error("THREE.WebGLRenderer: Attached DepthTexture is initialized to the incorrect size.");Ut.setupDepthRenderbuffer(y)}}const vt=y.texture;(vt.isData3DTexture||vt.isDataArrayTexture||vt.isCompressedArrayTexture)&&(ut=!0);const Et=Rt.get(y).__webglFramebuffer;y.isWebGLCubeRenderTarget?(Array.isArray(Et[I])?B=Et[I][X]:B=Et[I],H=!0):y.samples>0&&Ut.useMultisampledRTT(y)===!1?B=Rt.get(y).__webglMultisampledFramebuffer:Array.isArray(Et)?B=Et[X]:B=Et,et.copy(y.viewport),xt.copy(y.scissor),Nt=y.scissorTest}else et.copy(Pt).multiplyScalar(gt).floor(),xt.copy(ie).multiplyScalar(gt).floor(),Nt=oe;if(X!==0&&(B=F),dt.bindFramebuffer(O.FRAMEBUFFER,B)&&dt.drawBuffers(y,B),dt.viewport(et),dt.scissor(xt),dt.setScissorTest(Nt),H){const ct=Rt.get(y.texture);O.framebufferTexture2D(O.FRAMEBUFFER,O.COLOR_ATTACHMENT0,O.TEXTURE_CUBE_MAP_POSITIVE_X+I,ct.__webglTexture,X)}else if(ut){const ct=I;for(let vt=0;vt<y.textures.length;vt++){const Et=Rt.get(y.textures[vt]);O.framebufferTextureLayer(O.FRAMEBUFFER,O.COLOR_ATTACHMENT0+vt,Et.__webglTexture,X,ct)}}else if(y!==null&&X!==0){const ct=Rt.get(y.texture);O.framebufferTexture2D(O.FRAMEBUFFER,O.COLOR_ATTACHMENT0,O.TEXTURE_2D,ct.__webglTexture,X)}W=-1};function hu(y){const I=Rt.get(y);return(I.__readFormat!==y.format||I.__readType!==y.type)&&(I.__readFormat=y.format,I.__readType=y.type,I.__formatReadable=pe.textureFormatReadable(y.format),I.__typeReadable=pe.textureTypeReadable(y.type)),I}this.readRenderTargetPixels=function(y,I,X,B,H,ut,bt,ct=0){if(!(y&&y.isWebGLRenderTarget)){Qt("WebGLRenderer.readRenderTargetPixels: renderTarget is not THREE.WebGLRenderTarget.");return}let vt=Rt.get(y).__webglFramebuffer;if(y.isWebGLCubeRenderTarget&&bt!==void 0&&(vt=vt[bt],Array.isArray(vt)&&(vt=vt[0])),vt){dt.bindFramebuffer(O.FRAMEBUFFER,vt);try{const Et=y.textures[ct],Ot=Et.format,Wt=Et.type;y.textures.length>1&&O.readBuffer(O.COLOR_ATTACHMENT0+ct);const yt=hu(Et);if(yt.__formatReadable===!1){Qt("WebGLRenderer.readRenderTargetPixels: renderTarget is not in RGBA or implementation defined format.");return}if(yt.__typeReadable===!1){Qt("WebGLRenderer.readRenderTargetPixels: renderTarget is not in UnsignedByteType or implementation defined type.");return}I>=0&&I<=y.width-B&&X>=0&&X<=y.height-H&&O.readPixels(I,X,B,H,st.convert(Ot),st.convert(Wt),ut)}finally{const Et=tt!==null?Rt.get(tt).__webglFramebuffer:null;dt.bindFramebuffer(O.FRAMEBUFFER,Et)}}},this.readRenderTargetPixelsAsync=async function(y,I,X,B,H,ut,bt,ct=0){if(!(y&&y.isWebGLRenderTarget))throw new Error("THREE.WebGLRenderer.readRenderTargetPixels: renderTarget is not THREE.WebGLRenderTarget.");let vt=Rt.get(y).__webglFramebuffer;if(y.isWebGLCubeRenderTarget&&bt!==void 0&&(vt=vt[bt],Array.isArray(vt)&&(vt=vt[0])),vt)if(I>=0&&I<=y.width-B&&X>=0&&X<=y.height-H){dt.bindFramebuffer(O.FRAMEBUFFER,vt);const Et=y.textures[ct],Ot=Et.format,Wt=Et.type;y.textures.length>1&&O.readBuffer(O.COLOR_ATTACHMENT0+ct);const yt=hu(Et);if(yt.__formatReadable===!1)throw new Error("THREE.WebGLRenderer.readRenderTargetPixelsAsync: renderTarget is not in RGBA or implementation defined format.");if(yt.__typeReadable===!1)throw new Error("THREE.WebGLRenderer.readRenderTargetPixelsAsync: renderTarget is not in UnsignedByteType or implementation defined type.");const Xt=O.createBuffer();O.bindBuffer(O.PIXEL_PACK_BUFFER,Xt),O.bufferData(O.PIXEL_PACK_BUFFER,ut.byteLength,O.STREAM_READ),O.readPixels(I,X,B,H,st.convert(Ot),st.convert(Wt),0),O.bindBuffer(O.PIXEL_PACK_BUFFER,null);const Te=tt!==null?Rt.get(tt).__webglFramebuffer:null;dt.bindFramebuffer(O.FRAMEBUFFER,Te);const he=O.fenceSync(O.SYNC_GPU_COMMANDS_COMPLETE,0);return O.flush(),await Y0(O,he,4),O.bindBuffer(O.PIXEL_PACK_BUFFER,Xt),O.getBufferSubData(O.PIXEL_PACK_BUFFER,0,ut),O.bindBuffer(O.PIXEL_PACK_BUFFER,null),O.deleteBuffer(Xt),O.deleteSync(he),ut}else throw new Error("THREE.WebGLRenderer.readRenderTargetPixelsAsync: requested read bounds are out of range.")},this.copyFramebufferToTexture=function(y,I=null,X=0){const B=Math.pow(2,-X),H=Math.floor(y.image.width*B),ut=Math.floor(y.image.height*B),bt=I!==null?I.x:0,ct=I!==null?I.y:0;Ut.setTexture2D(y,0),O.copyTexSubImage2D(O.TEXTURE_2D,X,0,0,bt,ct,H,ut),dt.unbindTexture()},this.copyTextureToTexture=function(y,I,X=null,B=null,H=0,ut=0){let bt,ct,vt,Et,Ot,Wt,yt,Xt,Te;const he=y.isCompressedTexture?y.mipmaps[ut]:y.image;if(X!==null)bt=X.max.x-X.min.x,ct=X.max.y-X.min.y,vt=X.isBox3?X.max.z-X.min.z:1,Et=X.min.x,Ot=X.min.y,Wt=X.isBox3?X.min.z:0;else{const Kt=Math.pow(2,-H);bt=Math.floor(he.width*Kt),ct=Math.floor(he.height*Kt),y.isDataArrayTexture?vt=he.depth:y.isData3DTexture?vt=Math.floor(he.depth*Kt):vt=1,Et=0,Ot=0,Wt=0}B!==null?(yt=B.x,Xt=B.y,Te=B.z):(yt=0,Xt=0,Te=0);const ae=st.convert(I.format),qe=st.convert(I.type);let St;I.isData3DTexture?(Ut.setTexture3D(I,0),St=O.TEXTURE_3D):I.isDataArrayTexture||I.isCompressedArrayTexture?(Ut.setTexture2DArray(I,0),St=O.TEXTURE_2D_ARRAY):(Ut.setTexture2D(I,0),St=O.TEXTURE_2D),dt.activeTexture(O.TEXTURE0),dt.pixelStorei(O.UNPACK_FLIP_Y_WEBGL,I.flipY),dt.pixelStorei(O.UNPACK_PREMULTIPLY_ALPHA_WEBGL,I.premultiplyAlpha),dt.pixelStorei(O.UNPACK_ALIGNMENT,I.unpackAlignment);const Qe=dt.getParameter(O.UNPACK_ROW_LENGTH),te=dt.getParameter(O.UNPACK_IMAGE_HEIGHT),Xi=dt.getParameter(O.UNPACK_SKIP_PIXELS),$e=dt.getParameter(O.UNPACK_SKIP_ROWS),lo=dt.getParameter(O.UNPACK_SKIP_IMAGES);dt.pixelStorei(O.UNPACK_ROW_LENGTH,he.width),dt.pixelStorei(O.UNPACK_IMAGE_HEIGHT,he.height),dt.pixelStorei(O.UNPACK_SKIP_PIXELS,Et),dt.pixelStorei(O.UNPACK_SKIP_ROWS,Ot),dt.pixelStorei(O.UNPACK_SKIP_IMAGES,Wt);const wi=y.isDataArrayTexture||y.isData3DTexture,qi=I.isDataArrayTexture||I.isData3DTexture;if(y.isDepthTexture){const Kt=Rt.get(y),Ge=Rt.get(I),Tn=Rt.get(Kt.__renderTarget),_e=Rt.get(Ge.__renderTarget);dt.bindFramebuffer(O.READ_FRAMEBUFFER,Tn.__webglFramebuffer),dt.bindFramebuffer(O.DRAW_FRAMEBUFFER,_e.__webglFramebuffer);for(let Be=0;Be<vt;Be++)wi&&(O.framebufferTextureLayer(O.READ_FRAMEBUFFER,O.COLOR_ATTACHMENT0,Rt.get(y).__webglTexture,H,Wt+Be),O.framebufferTextureLayer(O.DRAW_FRAMEBUFFER,O.COLOR_ATTACHMENT0,Rt.get(I).__webglTexture,ut,Te+Be)),O.blitFramebuffer(Et,Ot,Et+bt,Ot+ct,yt,Xt,yt+bt,Xt+ct,O.DEPTH_BUFFER_BIT,O.NEAREST);dt.bindFramebuffer(O.READ_FRAMEBUFFER,null),dt.bindFramebuffer(O.DRAW_FRAMEBUFFER,null)}else if(H!==0||y.isRenderTargetTexture||Rt.has(y)){const Kt=Rt.get(y),Ge=Rt.get(I);dt.bindFramebuffer(O.READ_FRAMEBUFFER,L),dt.bindFramebuffer(O.DRAW_FRAMEBUFFER,z);for(let Tn=0;Tn<vt;Tn++)wi?O.framebufferTextureLayer(O.READ_FRAMEBUFFER,O.COLOR_ATTACHMENT0,Kt.__webglTexture,H,Wt+Tn):O.framebufferTexture2D(O.READ_FRAMEBUFFER,O.COLOR_ATTACHMENT0,O.TEXTURE_2D,Kt.__webglTexture,H),qi?O.framebufferTextureLayer(O.DRAW_FRAMEBUFFER,O.COLOR_ATTACHMENT0,Ge.__webglTexture,ut,Te+Tn):O.framebufferTexture2D(O.DRAW_FRAMEBUFFER,O.COLOR_ATTACHMENT0,O.TEXTURE_2D,Ge.__webglTexture,ut),H!==0?O.blitFramebuffer(Et,Ot,Et+bt,Ot+ct,yt,Xt,yt+bt,Xt+ct,O.COLOR_BUFFER_BIT,O.NEAREST):qi?O.copyTexSubImage3D(St,ut,yt,Xt,Te+Tn,Et,Ot,bt,ct):O.copyTexSubImage2D(St,ut,yt,Xt,Et,Ot,bt,ct);dt.bindFramebuffer(O.READ_FRAMEBUFFER,null),dt.bindFramebuffer(O.DRAW_FRAMEBUFFER,null)}else qi?y.isDataTexture||y.isData3DTexture?O.texSubImage3D(St,ut,yt,Xt,Te,bt,ct,vt,ae,qe,he.data):I.isCompressedArrayTexture?O.compressedTexSubImage3D(St,ut,yt,Xt,Te,bt,ct,vt,ae,he.data):O.texSubImage3D(St,ut,yt,Xt,Te,bt,ct,vt,ae,qe,he):y.isDataTexture?O.texSubImage2D(O.TEXTURE_2D,ut,yt,Xt,bt,ct,ae,qe,he.data):y.isCompressedTexture?O.compressedTexSubImage2D(O.TEXTURE_2D,ut,yt,Xt,he.width,he.height,ae,he.data):O.texSubImage2D(O.TEXTURE_2D,ut,yt,Xt,bt,ct,ae,qe,he);dt.pixelStorei(O.UNPACK_ROW_LENGTH,Qe),dt.pixelStorei(O.UNPACK_IMAGE_HEIGHT,te),dt.pixelStorei(O.UNPACK_SKIP_PIXELS,Xi),dt.pixelStorei(O.UNPACK_SKIP_ROWS,$e),dt.pixelStorei(O.UNPACK_SKIP_IMAGES,lo),ut===0&&I.generateMipmaps===!0&&I.mipmapsAutoUpdate===!0&&O.generateMipmap(St),dt.unbindTexture()},this.initRenderTarget=function(y){Rt.get(y).__webglFramebuffer===void 0&&Ut.setupRenderTarget(y)},this.initTexture=function(y){y.isCubeTexture?Ut.setTextureCube(y,0):y.isData3DTexture?Ut.setTexture3D(y,0):y.isDataArrayTexture||y.isCompressedArrayTexture?Ut.setTexture2DArray(y,0):Ut.setTexture2D(y,0),dt.unbindTexture()},this.resetState=function(){$=0,k=0,tt=null,dt.reset(),ot.reset()},typeof __THREE_DEVTOOLS__<"u"&&__THREE_DEVTOOLS__.dispatchEvent(new CustomEvent("observe",{detail:this}))}get coordinateSystem(){return Un}get outputColorSpace(){return this._outputColorSpace}set outputColorSpace(t){this._outputColorSpace=t;const e=this.getContext();e.drawingBufferColorSpace=qt._getDrawingBufferColorSpace(t),e.unpackColorSpace=qt._getUnpackColorSpace()}}const lh=[0,1,2,3,4,5,6,7],Pa=[0,1,2].flatMap(n=>lh.filter(t=>!(t>>n&1)).map(t=>[t,t|1<<n])),Uy=["+x","-x","+y","-y","+z","-z"],ss=Uy.map(n=>{const t="xyz".indexOf(n[1]),e=n[0]==="+"?1:0;return lh.filter(i=>(i>>t&1)===e)});function ga(n){return n.kind==="corner"||n.kind==="point"?[n.index]:n.ends!==void 0?[...n.ends]:[...(n.kind==="edge"?Pa:ss)[n.index]]}function Zn(n,t=[...n.keys()]){const e=new C;for(const i of t)e.add(new C(...n[i]));return e.divideScalar(t.length).toArray()}function Vf(n){const t=[0,1,2].map(r=>{const o=new C;for(const a of lh)o.addScaledVector(new C(...n[a]),a>>r&1?1:-1);return o.normalize()}),[e,i,s]=t;return new Lt().set(e.x,i.x,s.x,e.y,i.y,s.y,e.z,i.z,s.z)}function Hf(n){return Gf(Vf(n))}function Gf(n){let t=n;for(let e=0;e<60;e++){const i=t.clone().invert().transpose();let s=0;if(i.elements.forEach((r,o)=>{const a=.5*(r+t.elements[o]);s=Math.max(s,Math.abs(a-t.elements[o])),i.elements[o]=a}),t=i,s<1e-15)break}return new ce().setFromRotationMatrix(new Yt().setFromMatrix3(t))}function Wf(n,t){const[e,i,s,r]=ss[t].map(h=>new C(...n[h])),o=i.clone().add(r).sub(e).sub(s),a=s.clone().add(r).sub(e).sub(i),l=new C(...Zn(n,ss[t])).sub(new C(...Zn(n))),c=o.cross(a).normalize();return(c.dot(l)<0?c.negate():c).toArray()}function Os(n){const t=[0,2,4].map(e=>new C(...Zn(n,ss[e])).distanceTo(new C(...Zn(n,ss[e+1]))));return(t[0]+t[1]+t[2])/6}const Oy=1.1,pd=48;function fi(n){return n.points??n.corners}function Yr(n,t){return Zn(fi(n),t)}function va(n,t,e,i){return i===null?{corners:n,pivot:t}:{corners:n,pivot:t,points:e,shape:i.shape,edges:i.edges,radius:i.radius}}function ch(n){const{corners:t,points:e,shape:i,edges:s}=n;if(e!==void 0&&s)return s.map(([c,h])=>[e[c],e[h]]);if(e===void 0)return Pa.map(([c,h])=>[t[c],t[h]]);if(i==null)return[];const[r,o,a]=i,l=[];return e.forEach((c,h)=>{const d=[h%r,Math.floor(h/r)%o,Math.floor(h/(r*o))];[1,r,r*o].forEach((u,p)=>{d[p]+1<[r,o,a][p]&&l.push([c,e[h+u]])})}),l}function Fy([n,t,e]){return[0,1,2,3,4,5,6,7].map(i=>(i&1)*(n-1)+n*((i>>1&1)*(t-1)+t*(i>>2&1)*(e-1)))}function ky(n,t){const{points:e,shape:i}=n;if(e===void 0||!i)return null;let s=0;for(let r=0;r<e.length;r++){const o=Cc(r,i);for(const a of[0,1,2])if(o[a]+1<i[a]&&s++===t)return{point:r,axis:a}}return null}function By(n,{point:t,axis:e}){return Xf(n,(i,s)=>i.every((r,o)=>o===e||r===s[o]),t)}function zy(n,t,e){return Xf(n,(i,s)=>i[e]===s[e],t)}function Cc(n,[t,e]){return[n%t,Math.floor(n/t)%e,Math.floor(n/(t*e))]}function Xf(n,t,e){const i=Cc(e,n);return Array.from({length:n[0]*n[1]*n[2]},(s,r)=>r).filter(s=>t(Cc(s,n),i))}function Vy(n,{radius:t,curve:e}){const i=Math.min(1,Math.max(0,1-n/t));switch(e){case"smooth":return i*i*(3-2*i);case"sphere":return Math.sqrt(Math.max(0,2*i-i*i));case"root":return Math.sqrt(i);case"sharp":return i*i;case"linear":return i}}function fd(n,t,e,i){const{points:s,shape:r}=n;if(s===void 0)return n;const o=s.map((c,h)=>{const d=t.includes(h)?1:i===null?0:l(c,i);return[c[0]+d*e[0],c[1]+d*e[1],c[2]+d*e[2]]}),a=r?Fy(r).map(c=>o[c]):n.corners;return{...n,points:o,corners:a};function l(c,h){const d=t.map(u=>Math.hypot(...c.map((p,g)=>p-s[u][g])));return Vy(Math.min(...d),h)}}function Hy(n,t,e){return Math.min(20*e,Math.max(.02*e,n*Oy**t))}function qf(n,t,e){const i=new C(...e).normalize(),s=new C(1,0,0);Math.abs(i.x)>.9&&s.set(0,1,0);const r=s.cross(i).normalize(),o=i.clone().cross(r);return Array.from({length:pd+1},(a,l)=>{const c=2*Math.PI*l/pd;return new C(...n).addScaledVector(r,t*Math.cos(c)).addScaledVector(o,t*Math.sin(c)).toArray()})}function br(n,t){const{corners:e,pivot:i}=t,s=r=>vd(t,o=>Yy(o,i,r));switch(n.kind){case"translate":return{...vd(t,r=>Rc(r,n.by)),pivot:Rc(i,n.by)};case"move_corners":return t.points?t:{...t,corners:Ky(e,n.corners,n.by)};case"move_point":return fd(t,[n.point],n.by,null);case"move_points":{const{points:r,by:o,radius:a=0,falloff:l="smooth"}=n;return fd(t,r,o,a>0?{radius:a,curve:l}:null)}case"rotate":return s(qy(n.rotation_deg,n.axes,e));case"scale":return s(gd($y(n.by),n.axes,e));case"shear":{const{xy:r=0,xz:o=0,yx:a=0,yz:l=0,zx:c=0,zy:h=0}=n,d=new Lt().set(1,r,o,a,1,l,c,h,1);return s(gd(d,n.axes,e))}case"bend":case"twist":case"taper":case"mirror":return t}}function $f(n,t){switch(n.kind){case"translate":case"move_corners":case"move_point":case"move_points":return{...n,by:Zy(n.by,t)};case"rotate":{const e=hh(n.rotation_deg);return e.w<0&&e.set(-e.x,-e.y,-e.z,-e.w),{...n,rotation_deg:Yf(new ce().slerp(e,t))}}case"scale":return{...n,by:n.by.map(e=>e**t)};case"shear":{const{xy:e=0,xz:i=0,yx:s=0,yz:r=0,zx:o=0,zy:a=0}=n;return{...n,xy:e*t,xz:i*t,yx:s*t,yz:r*t,zx:o*t,zy:a*t}}case"bend":case"twist":return{...n,degrees:t*n.degrees};case"taper":return{...n,factor:n.factor**t};case"mirror":return n}}function md(n){switch(n.kind){case"translate":case"move_corners":case"move_point":case"move_points":return Math.hypot(...n.by);case"rotate":return pi.radToDeg(hh(n.rotation_deg).angleTo(new ce));case"scale":return Math.max(...n.by.map(t=>Math.abs(Math.log(t))));case"shear":{const{xy:t=0,xz:e=0,yx:i=0,yz:s=0,zx:r=0,zy:o=0}=n;return Math.hypot(t,e,i,s,r,o)}case"bend":case"twist":return Math.abs(n.degrees);case"taper":return Math.abs(Math.log(n.factor));case"mirror":return 1}}function Gy(n,t){const e=(i,s)=>i.map(r=>Mn(Math.round(r/s)*s));switch(n.kind){case"translate":case"move_corners":case"move_point":case"move_points":return{...n,by:e(n.by,t.length)};case"rotate":return{...n,rotation_deg:e(n.rotation_deg,t.angle)};case"scale":return{...n,by:e(n.by,t.factor).map(i=>Math.max(i,t.factor))};case"shear":case"bend":case"twist":case"taper":case"mirror":return n}}function Wy(n){const t=Math.max(n,1e-9)/10,e=10**Math.floor(Math.log10(t));return Mn(t/e>=5?5*e:e)}function Xy(n){const t=(e,i)=>e.map(s=>Mn(s,i).toFixed(i)).join("  ");switch(n.kind){case"translate":case"move_corners":case"move_point":case"move_points":return t(n.by,3);case"rotate":return`${n.rotation_deg.map(e=>Mn(e,1).toFixed(1)).join("°  ")}°`;case"scale":return`× ${t(n.by,2)}`;case"shear":case"bend":case"twist":case"taper":case"mirror":return n.kind}}function hh(n){const[t,e,i]=n.map(s=>pi.degToRad(s));return new ce().setFromEuler(new Kn(t,e,i,"XYZ"))}function Yf(n){const{x:t,y:e,z:i}=new Kn().setFromQuaternion(n,"XYZ");return[t,e,i].map(s=>Mn(pi.radToDeg(s)))}function Mn(n,t=9){const e=Number(n.toFixed(t));return e===0?0:e}function qy(n,t,e){const i=hh(n);if(t==="cage"){const s=Hf(e);i.premultiply(s).multiply(s.clone().invert())}return new Lt().setFromMatrix4(new Yt().makeRotationFromQuaternion(i))}function gd(n,t,e){if(t!=="cage")return n;const i=Vf(e);return i.clone().multiply(n).multiply(i.clone().invert())}function $y([n,t,e]){return new Lt().set(n,0,0,0,t,0,0,0,e)}function vd(n,t){const e=n.corners.map(t);return n.points===void 0?{...n,corners:e}:{...n,corners:e,points:n.points.map(t)}}function Yy(n,t,e){const i=new C(...t);return new C(...n).sub(i).applyMatrix3(e).add(i).toArray()}function Ky(n,t,e){return n.map((i,s)=>t.includes(s)?Rc(i,e):i)}function Rc(n,t){return[n[0]+t[0],n[1]+t[1],n[2]+t[2]]}function Zy(n,t){return[n[0]*t,n[1]*t,n[2]*t]}const _d=1e-9;function jy(n,t){const e=new C(...t),i=new C(.5,.5,.5);for(let s=0;s<20;s++){const{position:r,jacobian:o}=xd(n,i),a=e.clone().sub(r).applyMatrix3(o.invert());if(i.add(a).clampScalar(-1,2),a.lengthSq()<1e-24)break}return xd(n,i).position.distanceTo(e)>1e-6?!1:[i.x,i.y,i.z].every(s=>s>=-_d&&s<=1+_d)}function Qy(n,t,e){if(e===null)return 1;const i=a=>fi(br($f(n,a),t)).every(l=>jy(e,l));if(i(1)||!i(0))return 1;const s=n.kind==="rotate"?16:4;let r=1;for(let a=1;a<=s;a++)if(!i(a/s)){r=a/s;break}let o=r-1/s;for(;r-o>.001;){const a=.5*(o+r);i(a)?o=a:r=a}return o}function Jy(n,t){if(t===null||t.part>=1||t.operation.kind!==n.kind)return 1;const e=md(n);return e>0?Math.min(1,t.part*md(t.operation)/e):1}function xd(n,t){const e=new C,i=[new C,new C,new C],s=[t.x,t.y,t.z];n.forEach((l,c)=>{const h=[c&1,c>>1&1,c>>2&1],d=h.map((p,g)=>p?s[g]:1-s[g]),u=new C(...l);e.addScaledVector(u,d[0]*d[1]*d[2]),i.forEach((p,g)=>{const x=d[(g+1)%3]*d[(g+2)%3];p.addScaledVector(u,h[g]?x:-x)})});const[r,o,a]=i;return{position:e,jacobian:new Lt().set(r.x,o.x,a.x,r.y,o.y,a.y,r.z,o.z,a.z)}}const tS=1e-5,eS="the inner cage must stay inside the outer cage; enlarge the outer cage (Set mode)";function Kf(n){return{inner:va(n.inner,n.inner_pivot,n.points?.canonical??[],n.points),deformed:va(n.deformed,n.pivot,n.points?.deformed??[],n.points),outer:n.outer&&{corners:n.outer,pivot:n.outer_pivot??Zn(n.outer)}}}function Dn(n,t){return t==="field"?n.deformed:t==="outer"&&n.outer?n.outer:n.inner}function ta(n,t){const e=tS*Os(n.corners),i=fi(t);return fi(n).every((s,r)=>s.every((o,a)=>Math.abs(o-i[r][a])<=e))}function nS(n,t){const e=n.outer===null||t.outer===null?n.outer===t.outer:ta(n.outer,t.outer);return ta(n.inner,t.inner)&&ta(n.deformed,t.deformed)&&e}class iS{constructor(t,e,i,s){this.id=t,this.edit=e,this.target=i,this.send=s,this.start=Kf(e),this.shown=this.start,s({type:"drag_begin",drag:t,edit:e.id,target:i})}start;shown;operation=null;followed=null;seq=0;why=null;ended=!1;lastAnswer=null;sent=new Map;move(t){if(this.ended)return;this.operation=t,this.seq+=1,this.sent.set(this.seq,t),this.send({type:"drag",drag:this.id,seq:this.seq,operation:t});const e=this.isConfined?Qy(t,this.start.deformed,this.outerCorners):1,i=Jy(t,this.lastAnswer),s=Math.min(e,i);this.why=s>=1?null:this.lastAnswer?.why??eS,this.applyShare(t,s)}takeAnswer(t){const e=this.sent.get(t.seq);if(t.drag!==this.id||e===void 0)return!1;for(const r of this.sent.keys())r<t.seq&&this.sent.delete(r);if(this.lastAnswer={operation:e,part:t.part,why:t.why},t.seq!==this.seq)return!1;this.why=t.why;const i=this.shown;this.applyShare(e,t.part);const s=this.shown;return this.shown={inner:va(t.inner,s.inner.pivot,t.points,this.edit.points),deformed:va(t.deformed,s.deformed.pivot,t.deformed_points,this.edit.points),outer:t.outer&&{corners:t.outer,pivot:s.outer?.pivot??Zn(t.outer)}},!nS(i,this.shown)}end(){this.ended||(this.ended=!0,this.operation===null?this.send({type:"drag_cancel",drag:this.id}):this.send({type:"drag_end",drag:this.id,seq:this.seq,operation:this.operation}))}cancel(){this.ended||(this.ended=!0,this.shown=this.start,this.send({type:"drag_cancel",drag:this.id}))}applyShare(t,e){this.followed=e<1?$f(t,e):t,this.shown=this.cagesAfter(this.followed)}get isConfined(){return this.target==="field"&&this.edit.kind==="continuous"&&!this.edit.outer_follows}get outerCorners(){return this.start.outer?.corners??null}cagesAfter(t){const{inner:e,deformed:i,outer:s}=this.start;switch(this.target){case"field":{const r=br(t,i);return{inner:this.edit.source===null?e:r,deformed:r,outer:s}}case"outer":return{inner:e,deformed:i,outer:s&&br(t,s)};case"inner":return{...this.innerAfter(t),outer:s};case"both":{if(this.edit.outer_follows)return{...this.innerAfter(t),outer:s};const r=t.kind==="move_corners"?s?.pivot:e.pivot,o=s&&r?br(t,{corners:s.corners,pivot:r}):null;return{...this.innerAfter(t),outer:o}}}}innerAfter(t){const e=br(t,this.start.inner);return{inner:e,deformed:this.edit.operations.length===0||this.edit.source!==null?e:this.start.deformed}}}const Es={measured:null,placesHotspot:!1,picked:null},sS={connection:"connecting",hello:null,state:null,mode:"edit",tool:"translate",axes:"world",cage:"inner",snap:!1,view:"color",before:!1,split:null,grid:!1,cages:!0,panel:!0,help:!1,corners:[],proportional:!1,proportionalRadius:null,curve:"smooth",hover:null,selecting:null,measured:null,placesHotspot:!1,picked:null,selectMode:"replace",brushRadius:.04,through:!1,depthTolerance:1.5,floodOpacity:.3,floodReach:1,limit:null,notice:null,preparing:null,jobs:[],upload:null,preview:null,loading:null,figures:{perSecond:0,renderMs:0,encodeMs:0,width:0,height:0,whole:!1,final:!1,page:!1}};class rS{editor;listeners=[];constructor(t={}){this.editor={...sS,...t}}get now(){return this.editor}set(t){const e=this.editor;if(Object.keys(t).every(r=>Object.is(e[r],t[r])))return;this.editor={...e,...t};const s=this.editor;for(const r of this.listeners)r(s,e)}listen(t){this.listeners.push(t)}watch(t,e){this.listen((i,s)=>{t.some(r=>i[r]!==s[r])&&e(i)}),e(this.editor)}}function xe(n){const t=n.state;return t?.edits.find(e=>e.id===t.selected)??null}function Nr(n){return n.measured!==null||n.placesHotspot||n.picked!==null}function La(n){return n.state?.up??n.hello?.up??[0,0,1]}function _a(n){return n.cages&&n.preview===null}function ui(n){return n.mode==="edit"?"field":xe(n)?.outer===null?"inner":n.cage}const Kr="this link may look but not change anything",oS=["camera","display","presented","drawing","ask"];function Xe(n){return n.hello?.read_only===!0}function aS(n,t){return!Xe(n)||oS.includes(t.type)}function Ur(n,t){const{mode:e}=n;return Xe(n)?Kr:t.locked?`“${t.name}” is locked`:t.enabled?e==="edit"&&t.kind==="delete"?"a delete has nothing to move; choose another kind, or Set mode (Tab)":null:`“${t.name}” is hidden; show it (H) to move it`}function Zf(n){return xe(n)!==null}function lS({preparing:n,figures:t,state:e}){return n===null||n.done>=n.of?null:(e?.edits.some(s=>s.enabled&&(s.fill!=="none"||s.relight!=="none"))??!1)&&t.width>0&&!t.final?"Computing fill and light":`Preparing the renderer ${n.done+1}/${n.of} – a machine's first run only`}function jf(n){const t=xe(n);return t!==null&&t.kind!=="continuous"&&t.kind!=="copy"}const Fo="http://www.w3.org/2000/svg",cS=4,bd=10,hS=4;class uS{constructor(t,e){this.host=t,this.askScale=e,this.element.setAttribute("class","measurement"),this.element.append(this.line,...this.marks,this.label);for(const i of this.marks)i.setAttribute("r",String(cS));t.viewport.beforeFrame.push(()=>this.show()),t.store.watch(["measured","state"],()=>{this.show(),t.viewport.invalidate()})}element=document.createElementNS(Fo,"svg");line=document.createElementNS(Fo,"line");marks=[0,1].map(()=>document.createElementNS(Fo,"circle"));label=document.createElementNS(Fo,"text");add(t,e){const{store:i,viewport:s,pictures:r}=this.host,{measured:o}=i.now;if(o===null)return;const a=uh(s,r,t,e);if(a===null){this.host.say("nothing is there to measure from; click on a surface","warning");return}const l=o.length===2?[a]:[...o,a];i.set({measured:l}),l.length===2&&!Xe(i.now)&&this.askScale(wd(l))}show(){const{measured:t,state:e}=this.host.store.now,i=(t??[]).map(l=>this.host.viewport.project(l)),s=i.map(l=>l.depth>0);this.marks.forEach((l,c)=>{l.style.display=s[c]?"":"none",s[c]&&(l.setAttribute("cx",String(i[c].x)),l.setAttribute("cy",String(i[c].y)))});const r=i.length===2&&s.every(Boolean);if(this.line.style.display=this.label.style.display=r?"":"none",!r||t===null)return;const[o,a]=i;this.line.setAttribute("x1",String(o.x)),this.line.setAttribute("y1",String(o.y)),this.line.setAttribute("x2",String(a.x)),this.line.setAttribute("y2",String(a.y)),this.label.setAttribute("x",String(.5*(o.x+a.x)+bd)),this.label.setAttribute("y",String(.5*(o.y+a.y)-bd)),this.label.textContent=Qf(wd(t),e?.meters_per_unit??null)}}function uh(n,t,e,i){const s=t.depth.at(e/n.points.width,i/n.points.height);if(s===null)return null;const{origin:r,direction:o}=n.ray(e,i),a=o.toArray();return r.toArray().map((l,c)=>l+s*a[c])}function wd([n,t]){return Math.hypot(...n.map((e,i)=>e-t[i]))}function Qf(n,t){const e=n*(t??1),i=Math.min(20,Math.max(0,hS-1-Math.floor(Math.log10(e))));return`${Mn(e,i)} ${t===null?"units":"m"}`}const Jf="http://www.w3.org/2000/svg",dS=4,yd=8,tm=3,dh=3,Pc={up:tm,paste:2*dh},pS={up:"three points are there: up is the normal of their plane",paste:`${dh} pairs are there`};class fS{constructor(t,e){this.host=t,this.actions=e,this.element.setAttribute("class","measurement picked"),t.viewport.beforeFrame.push(()=>this.show()),t.store.watch(["picked"],()=>{this.show(),t.viewport.invalidate()})}element=document.createElementNS(Jf,"svg");add(t,e){const{store:i,viewport:s,pictures:r}=this.host,{picked:o}=i.now;if(o===null)return;const{purpose:a}=o,l=uh(s,r,t,e);if(l===null)return this.host.say("nothing is there; click on a surface","warning");const c=o.points.length===Pc[a]?[l]:[...o.points,l],h=c.length===Pc[a];i.set({picked:h&&a==="up"?null:{purpose:a,points:c}}),this.host.say(h?pS[a]:em({purpose:a,points:c}),"info"),h&&(a==="up"?this.actions.plane(c):this.actions.pairs(mS(c)))}show(){const{picked:t}=this.host.store.now,e=[],i=(t?.points??[]).map(s=>this.host.viewport.project(s));i.forEach(({x:s,y:r,depth:o},a)=>{if(o<=0)return;const l=t?.purpose==="paste"&&a%2===1?i[a-1]:null;l!==null&&l.depth>0&&e.push(gl("line",{x1:l.x,y1:l.y,x2:s,y2:r})),e.push(gl("circle",{cx:s,cy:r,r:dS}));const c=gl("text",{x:s+yd,y:r-yd});c.textContent=t===null?"":gS(t.purpose,a),e.push(c)}),this.element.replaceChildren(...e)}}function mS(n){return Array.from({length:Math.floor(n.length/2)},(t,e)=>({pasted:n[2*e],scene:n[2*e+1]}))}function em({purpose:n,points:t}){const e=t.length%Pc[n];if(n==="up")return`click on point ${e+1} of ${tm} of something level`;const i=`pair ${Math.floor(e/2)+1} of ${dh}`;return e%2===0?`${i}: click on the pasted thing`:`${i}: click where that point belongs`}function gS(n,t){return n==="up"?String(t+1):`${Math.floor(t/2)+1}${t%2===0?"":"′"}`}function gl(n,t){const e=document.createElementNS(Jf,n);for(const[i,s]of Object.entries(t))e.setAttribute(i,String(s));return e}const nm=[".ply",".spz",".sog",".splat",".ksplat",".glb",".gltf"];function vS(n){return nm.some(t=>n.toLowerCase().endsWith(t))}function _S(n,t){const e=new URL("open",n.href),i=new URLSearchParams(n.search);return i.set("name",t),e.search=i.toString(),e.hash="",e.href}function xS(n,t,e,i){return new Promise(s=>{n.upload.onprogress=({loaded:r,total:o})=>i(o>0?r/o:0),n.onload=()=>s(n.status===200?null:n.responseText.trim()||`the server refused it (${n.status})`),n.onerror=()=>s(`${t.name} could not be sent: the server is gone`),n.open("POST",e),n.send(t)})}const im="cagefield.tools",sm="cagefield.camera",bS=["mode","tool","axes","cage","view","grid","panel"];function wS(){return rm(im)??{}}function yS(){return rm(sm)}function SS(n,t){sessionStorage.setItem(im,JSON.stringify(Object.fromEntries(bS.map(e=>[e,n[e]])))),sessionStorage.setItem(sm,JSON.stringify(t))}function ES(n){return localStorage.getItem(n)!==null?!1:(localStorage.setItem(n,"used"),!0)}function rm(n){const t=sessionStorage.getItem(n);if(t===null)return null;try{return JSON.parse(t)}catch{return null}}const MS=["color","depth","opacity","normals"],TS="cagefield.proportional",AS=["inner","outer","both"],CS=.005,RS=.5,Sd=1.2,PS=75e4;class LS{constructor(t,e=()=>{}){this.app=t,this.askFolder=e}cameraIndex=-1;setTool(t){this.app.store.set({tool:t,selecting:null,...Es})}toggleSelecting(t){const{selecting:e}=this.app.store.now;this.app.store.set({selecting:e===t?null:t,...Es,hover:null})}toggleMeasuring(){const{measured:t}=this.app.store.now;this.app.store.set({...Es,measured:t===null?[]:null,selecting:null,hover:null})}toggleHotspots(){const{placesHotspot:t}=this.app.store.now;this.app.store.set({...Es,placesHotspot:!t,selecting:null,hover:null})}togglePicking(t){const{now:e}=this.app.store;if(t==="paste"&&xe(e)?.source==null)return this.app.say("choose an edit that pastes: pairs of points align what is pasted","warning");const i=e.picked?.purpose===t?null:{purpose:t,points:[]};this.app.store.set({...Es,picked:i,selecting:null,hover:null}),i!==null&&this.app.say(em(i))}resizeBrush(t){const{selecting:e,brushRadius:i}=this.app.store.now;if(e!=="brush")return!1;const s=i*(t>0?Sd:1/Sd);return this.app.store.set({brushRadius:Math.min(RS,Math.max(CS,s))}),!0}changeSelection(t){this.app.send({type:"change_selection",change:t})}toggleIsolated(){this.app.send({type:"isolate",on:this.app.store.now.state?.isolated!==!0})}removeElements(){if(this.app.store.now.state?.selection==null)return this.app.say("nothing is selected: paint with the brush (M), or drag a lasso (J)","warning");this.app.send({type:"remove_elements"})}restoreElements(){this.app.send({type:"remove_elements",restore:!0})}remove(){const{selecting:t,state:e}=this.app.store.now;t!==null&&e?.selection!=null?this.removeElements():this.removeSelected()}encloseSelection(t="box",e){if(this.app.store.now.state?.selection==null)return this.app.say("nothing is selected: paint with the brush (M), or drag a lasso (J)","warning");this.app.expectEdit(),this.app.send({type:"selection_cage",cage:t,...e===void 0?{}:{margin:e}})}setMode(t){this.app.store.set({mode:t,corners:[],hover:null})}toggleMode(){this.setMode(this.app.store.now.mode==="set"?"edit":"set")}toggleAxes(){this.app.store.set({axes:this.app.store.now.axes==="world"?"cage":"world"})}setCage(t){this.app.store.set({cage:t,corners:[],hover:null})}nextCage(){this.setCage(Ed(AS,this.app.store.now.cage))}setView(t){this.app.store.set({view:t})}nextView(){this.setView(Ed(MS,this.app.store.now.view))}toggleProportional(t){const e=!this.app.store.now.proportional;this.app.store.set({proportional:e}),t&&ES(TS)?this.app.say("O is proportional editing of points now; Shift+O shows or hides the cages"):this.app.say(`proportional editing is ${e?"on: the wheel changes its radius":"off"}`)}toggleConnected(){this.withSelected(t=>{if(t.cage!=="points"||t.points===null)return this.app.say("connected only is for control points (Ctrl+double-click)","warning");const e=!t.points.connected;this.app.send({type:"point_reach",edit:t.id,connected:e}),this.app.say(`connected only is ${e?"on: the points reach through dense matter alone":"off"}`)})}placePoint(){this.app.expectEdit(),this.app.send({type:"place_point"})}subdivide(t,e){this.withSelected(i=>this.app.send({type:"subdivide",edit:i.id,cells:t,interpolation:e}))}toggle(t){this.app.store.set({[t]:!this.app.store.now[t]})}toggleSplit(){this.app.store.set({split:this.app.store.now.split===null?.5:null})}command(t,e=null){this.app.send({type:"command",name:t,edit:e})}withSelected(t){const e=xe(this.app.store.now);e===null?this.app.say("no edit is selected: double-click the picture to make one","warning"):t(e)}duplicate(){this.withSelected(t=>this.command("duplicate",t.id))}removeSelected(){this.withSelected(t=>this.command("remove",t.id))}mirror(t){this.withSelected(e=>this.app.send({type:"mirror",edit:e.id,axis:t}))}toggleEnabled(){this.withSelected(t=>this.app.send({type:"change",edit:t.id,enabled:!t.enabled}))}toggleKind(){this.withSelected(t=>{if(t.source!==null)return this.app.say("a paste is always a copy; remove the edit to remove the paste","warning");const e=t.kind==="continuous"?"move":"continuous";this.app.send({type:"change",edit:t.id,kind:e})})}toggleFill(){this.withSelected(t=>{jf(this.app.store.now)?this.app.send({type:"change",edit:t.id,fill:t.fill==="none"?"surroundings":"none"}):this.app.say("only a move or a delete uncovers something to fill","warning")})}toggleShadows(){this.withSelected(t=>{Zf(this.app.store.now)?this.app.send({type:"change",edit:t.id,relight:t.relight==="none"?"occlusion":"none"}):this.app.say("choose an edit first: its shadows go along, or stay","warning")})}place(t={}){this.app.expectEdit(),this.app.send({type:"place",...t})}fitInner(){this.withSelected(t=>this.app.send({type:"fit_inner",edit:t.id}))}outerMargin(t){this.withSelected(e=>this.app.send({type:"outer_margin",edit:e.id,margin:t}))}focus(t,e){const i=xe(this.app.store.now);if(i!==null){const o=Dn(this.app.shownCages(i),ui(this.app.store.now));this.app.viewport.focus(Yr(o),2*Os(o.corners));return}const{width:s,height:r}=this.app.viewport.points;this.app.ask({what:"surface",x:t/s,y:e/r}).then(o=>{if(!o?.point)return;const{point:a}=o,l=this.app.viewport.camera.position.toArray();this.app.viewport.focus(a,.2*Math.hypot(...a.map((c,h)=>c-l[h])))})}lookFrom(t){const{hello:e}=this.app.store.now;if(e===null)return;const i=e.bounds[0].map((r,o)=>.5*(r+e.bounds[1][o]));let s=e.start.c2w;t!==null&&e.cameras.length>0&&(this.cameraIndex=(this.cameraIndex+t+e.cameras.length)%e.cameras.length,s=e.cameras[this.cameraIndex],this.app.say(`camera ${this.cameraIndex+1} of ${e.cameras.length}`)),this.app.viewport.lookFrom(s,e.start.fov_y_deg,La(this.app.store.now),i)}copy(){this.withSelected(t=>{this.app.ask({what:"edit_text",edit:t.id}).then(async e=>{if(e?.text)try{await navigator.clipboard.writeText(e.text),this.app.say(`“${t.name}” is copied as text`)}catch{this.app.say("the browser does not let this page write to the clipboard","error")}})})}paste(t){t.trim()!==""&&this.app.send({type:"load_edits",text:t,append:!0})}async load(t){vS(t.name)?await this.open(t):t.name.toLowerCase().endsWith(".obj")?await this.placeMesh(t):this.app.send({type:"load_edits",text:await t.text(),append:!1})}async placeMesh(t){if(t.size>PS){this.app.say(`${t.name} is too large for a cage: decimate it to 512 vertices`,"error");return}const e=new Uint8Array(await t.arrayBuffer());let i="";for(const s of e)i+=String.fromCharCode(s);this.app.expectEdit(),this.app.send({type:"place_mesh",name:t.name,content:btoa(i)})}save(){this.app.store.now.state?.is_file?this.askFolder():this.command("save")}async open(t){if(this.app.store.now.upload!==null){this.app.say("another file is being opened","warning");return}const{name:e}=t;this.app.store.set({upload:{name:e,share:0}});const i=r=>this.app.store.set({upload:{name:e,share:r}}),s=await xS(new XMLHttpRequest,t,_S(location,e),i);this.app.store.set({upload:null}),s!==null&&this.app.say(s,"error")}addKey(){const{state:t}=this.app.store.now;if(t===null)return;const e=t.keys.at(-1)?.parts??{},i={c2w:this.app.viewport.c2w,fov_y_deg:this.app.viewport.camera.fov,seconds:2,parts:e};this.app.send({type:"set_path",keys:[...t.keys,i],loop:t.loop})}escape(t){const{now:e}=this.app.store;t()||(e.help?this.app.store.set({help:!1}):Nr(e)?this.app.store.set(Es):e.selecting!==null?this.app.store.set({selecting:null}):e.corners.length>0?this.app.store.set({corners:[]}):e.state?.selected!=null&&this.command("select",null))}}function Ed(n,t){return n[(n.indexOf(t)+1)%n.length]}function ea(n,[t,e,i]){return n===null?[t,e,i]:[0,4,8].map(s=>n[s]*t+n[s+1]*e+n[s+2]*i+n[s+3])}function DS(n,t){return n===null?t:{inner:vl(n,t.inner),deformed:vl(n,t.deformed),outer:t.outer&&vl(n,t.outer)}}function IS(n){return n===null?new ce:Gf(am(n))}function om(n,t){if(n===null||!("by"in t)||t.kind==="scale")return t;const e=new C(...t.by).applyMatrix3(am(n).invert()).toArray();return{...t,by:e.map(i=>Math.round(i*1e9)/1e9)}}function NS(n,t){const e=new Map(t.map(({edit:s,carrier:r})=>[s,r])),i=n.edits.map(s=>{const r=e.get(s.id);return r===void 0?s:{...s,carrier:r}});return{...n,edits:i}}function vl(n,t){const e={...t,corners:t.corners.map(i=>ea(n,i)),pivot:ea(n,t.pivot)};return t.points===void 0?e:{...e,points:t.points.map(i=>ea(n,i))}}function am(n){const[t,e,i,,s,r,o,,a,l,c]=n;return new Lt().set(t,e,i,s,r,o,a,l,c)}const Ii=1e9,US=65535;class OS{width=1;height=1;data=new Float32Array([Ii]);addPart(t,e){if(t.depth_width===0||t.depth_height===0)return;const i=Math.max(1,Math.round(t.full_width*t.depth_width/t.width)),s=Math.max(1,Math.round(t.full_height*t.depth_height/t.height));(i!==this.width||s!==this.height)&&this.resample(i,s);const r=Math.round(t.x*i/t.full_width),o=Math.round(t.y*s/t.full_height);for(let a=0;a<t.depth_height&&o+a<s;a++)for(let l=0;l<t.depth_width&&r+l<i;l++){const c=e[a*t.depth_width+l];this.data[(o+a)*i+r+l]=c===US?Ii:c*t.depth_scale}}replace(t,e,i){this.width=t,this.height=e,this.data=i.map(s=>s<Ii?s:Ii)}at(t,e){const i=Math.min(this.width-1,Math.max(0,Math.floor(t*this.width))),s=Math.min(this.height-1,Math.max(0,Math.floor(e*this.height))),r=this.data[s*this.width+i];return r<Ii?r:null}resample(t,e){const i=new Float32Array(t*e);for(let s=0;s<e;s++){const r=Math.floor((s+.5)*this.height/e)*this.width;for(let o=0;o<t;o++)i[s*t+o]=this.data[r+Math.floor((o+.5)*this.width/t)]}this.data=i,this.width=t,this.height=e}}const FS=`
uniform vec2 viewport;
in vec3 from;
in vec3 to;
in vec4 paint;
in vec2 stroke;
out vec3 world;
out vec4 tint;
out float hiddenAlpha;
out float side;
out float halfWidth;
out vec2 run;
void main() {
  vec4 a = projectionMatrix * viewMatrix * vec4(from, 1.0);
  vec4 b = projectionMatrix * viewMatrix * vec4(to, 1.0);
  vec3 p = from;
  vec3 q = to;
  float near = 1e-3;
  if (a.w < near && b.w < near) { gl_Position = vec4(2.0, 2.0, 2.0, 1.0); return; }
  if (a.w < near) { float t = (near - a.w) / (b.w - a.w); a = mix(a, b, t); p = mix(p, q, t); }
  else if (b.w < near) { float t = (near - b.w) / (a.w - b.w); b = mix(b, a, t); q = mix(q, p, t); }
  vec2 sa = 0.5 * viewport * a.xy / a.w;
  vec2 sb = 0.5 * viewport * b.xy / b.w;
  float reach = length(sb - sa);
  vec2 direction = reach > 0.0 ? (sb - sa) / reach : vec2(1.0, 0.0);
  halfWidth = 0.5 * stroke.x;
  float outer = halfWidth + 1.0;
  bool first = position.x < 0.5;
  vec4 clip = first ? a : b;
  vec2 offset = vec2(-direction.y, direction.x) * position.y * outer + direction * (first ? -0.5 : 0.5) * halfWidth;
  clip.xy += 2.0 * offset / viewport * clip.w;
  clip.z = 0.0;
  gl_Position = clip;
  world = first ? p : q;
  side = position.y * outer * clip.w;
  run = vec2((first ? 0.0 : reach) * clip.w, clip.w);
  tint = paint;
  hiddenAlpha = stroke.y;
}`,kS=`
uniform sampler2D depthMap;
uniform mat4 pictureProjection;
uniform vec3 pictureEye;
uniform float slack;
uniform float scale;
in vec3 world;
in vec4 tint;
in float hiddenAlpha;
in float side;
in float halfWidth;
in vec2 run;
out vec4 color;
bool isHidden() {
  vec4 clip = pictureProjection * vec4(world, 1.0);
  if (clip.w <= 0.0) return false;
  vec2 at = 0.5 + 0.5 * clip.xy / clip.w;
  if (any(lessThan(at, vec2(0.0))) || any(greaterThan(at, vec2(1.0)))) return false;
  float seen = texture(depthMap, vec2(at.x, 1.0 - at.y)).r;
  if (seen >= ${(.5*Ii).toFixed(1)}) return false;
  float own = length(world - pictureEye);
  return own > seen * 1.003 + slack;
}
void main() {
  float away = abs(side / run.y);
  if (away > halfWidth + 0.5) discard;
  float alpha = tint.a;
  float reach = halfWidth;
  if (isHidden()) {
    if (mod(run.x / run.y, 8.0 * scale) > 4.5 * scale) discard;
    alpha = hiddenAlpha;
    reach = min(halfWidth, 0.6);
  }
  alpha *= clamp(reach + 0.5 - away, 0.0, 1.0);
  if (alpha < 0.01) discard;
  color = vec4(tint.rgb, alpha);
}`;class BS{constructor(t,e){this.viewport=t,this.pictures=e,this.uniforms={viewport:{value:new It},depthMap:{value:e.depthTexture},pictureProjection:{value:new Yt},pictureEye:{value:new C},slack:{value:.01},scale:{value:1}},this.buffers=this.allocate(64);const i=new dn({vertexShader:FS,fragmentShader:kS,glslVersion:zi,transparent:!0,depthTest:!1,depthWrite:!1,uniforms:this.uniforms});this.mesh=new _t(this.geometry,i),this.mesh.frustumCulled=!1,this.mesh.renderOrder=1,t.scene.add(this.mesh),t.beforeFrame.push(()=>this.updateUniforms())}geometry=new Ve;mesh;buffers;capacity=0;uniforms;set slack(t){this.uniforms.slack.value=t}set(t){t.length>this.capacity&&(this.buffers=this.allocate(2*t.length));const{from:e,to:i,paint:s,stroke:r}=this.buffers,o=this.viewport.renderer.getPixelRatio();t.forEach((a,l)=>{const{r:c,g:h,b:d}=a.srgbColor;for(let u=4*l;u<4*l+4;u++)e.setXYZ(u,...a.from),i.setXYZ(u,...a.to),s.setXYZW(u,c,h,d,a.alpha),r.setXY(u,a.width*o,a.hiddenAlpha)});for(const a of Object.values(this.buffers))a.needsUpdate=!0;this.geometry.setDrawRange(0,6*t.length),this.mesh.visible=t.length>0}allocate(t){this.capacity=t;const e=(r,o)=>{const a=new un(new Float32Array(4*t*o),o);return a.setUsage(hf),this.geometry.setAttribute(r,a),a};this.geometry.dispose();const i=[0,-1,0,0,1,0,1,-1,0,1,1,0],s=Float32Array.from({length:12*t},(r,o)=>i[o%12]);return this.geometry.setAttribute("position",new un(s,3)),this.geometry.setIndex(Array.from({length:6*t},(r,o)=>4*Math.floor(o/6)+[0,2,1,1,2,3][o%6])),{from:e("from",3),to:e("to",3),paint:e("paint",4),stroke:e("stroke",2)}}updateUniforms(){const{width:t,height:e}=this.viewport.pixels;this.uniforms.viewport.value.set(t,e),this.uniforms.scale.value=this.viewport.renderer.getPixelRatio();const{viewpoint:i}=this.pictures;i!==null&&(this.uniforms.pictureProjection.value.copy(i.viewProjection),this.uniforms.pictureEye.value.copy(i.eye))}}function Or(n){return new Zt(n).convertLinearToSRGB()}const ph={corner:9,face:8,edge:6};function zS(n,t,{corners:e,eye:i},s){const r=e.map(s);return lm(n,t,e,s)??xa("face",hm(e,i).map(o=>o&&um(s(o),n,t,ph.face)))??xa("edge",Pa.map(([o,a])=>dm(r[o],r[a],n,t)))}function lm(n,t,e,i,s="corner"){return xa(s,e.map(r=>um(i(r),n,t,ph.corner)))}function cm(n,t,e,i){return lm(n,t,fi(e),i,e.points===void 0?"corner":"point")}function VS(n,t,e,i){const{points:s,edges:r}=e;if(s===void 0||!r)return null;const o=s.map(i),a=xa("edge",r.map(([l,c])=>dm(o[l],o[c],n,t)));return a&&{...a,ends:r[a.index]}}function hm(n,t){return ss.map((e,i)=>{const s=Zn(n,e);return Wf(n,i).reduce((a,l,c)=>a+l*(t[c]-s[c]),0)>0?s:null})}function HS(n,t,e,i,s){const r=ch(e).map(([a,l])=>fh(i(a),i(l),n,t)?.distance??1/0),o=Math.min(...r);return o<=s?ky(e,r.indexOf(o)):null}function GS(n,t,e,i){const s=ch(e).map(([o,a])=>fh(i(o),i(a),n,t)?.distance??1/0),r=(e.points??[]).map(i).filter(({depth:o})=>o>0);return Math.min(...s,...r.map(o=>Math.hypot(o.x-n,o.y-t)))}function xa(n,t){let e=null,i=1/0;return t.forEach((s,r)=>{s!==null&&s<i&&(i=s,e={kind:n,index:r})}),e}function um(n,t,e,i){return n.depth>0&&Math.hypot(n.x-t,n.y-e)<=i?n.depth:null}function dm(n,t,e,i){const s=fh(n,t,e,i);return s!==null&&s.distance<=ph.edge?s.depth:null}function fh(n,t,e,i){if(n.depth<=0||t.depth<=0)return null;const s=t.x-n.x,r=t.y-n.y,o=s*s+r*r,a=o>0?Math.min(1,Math.max(0,((e-n.x)*s+(i-n.y)*r)/o)):0;return{distance:Math.hypot(n.x+a*s-e,n.y+a*r-i),depth:n.depth+a*(t.depth-n.depth)}}const WS={width:2.4,alpha:1,hiddenAlpha:.6},XS={width:1.4,alpha:.85,hiddenAlpha:.3},qS={width:1.2,alpha:.9,hiddenAlpha:.9},pm={width:1.5,alpha:.75,hiddenAlpha:.35},$S={width:2,alpha:.95,hiddenAlpha:.45},YS={width:1,alpha:.25,hiddenAlpha:.12},KS={width:1,alpha:.5,hiddenAlpha:.3},ZS={width:1.4,alpha:.6,hiddenAlpha:.25},jS={width:1,alpha:.25,hiddenAlpha:.1},QS={width:.8,alpha:.34,hiddenAlpha:.1},fm={width:4,alpha:1,hiddenAlpha:.9},$s=Or("#ffffff"),JS=Or("#c9ced6");function ai(n,t){return DS(n.carrier,mm(n,t))}function mm(n,t){return t?.edit.id===n.id?t.shown:Kf(n)}function mh(n,t){if(n.mode==="edit")return[{cage:"inner",posed:t.deformed}];const e={cage:"inner",posed:t.inner};if(t.outer===null)return[e];const i={cage:"outer",posed:t.outer};return n.cage==="outer"?[i,e]:[e,i]}function tE(n,t,e,i,s){const r={segments:[],dots:[]};if(!_a(n)||n.state===null)return r;const o=xe(n);for(const l of n.state.edits){if(l===o||!l.enabled)continue;const c=ai(l,t),h=Or(l.color);Rr(r,c.deformed,h,ZS),gm(l)&&vm(r,c.deformed,h),c.outer&&l.kind==="continuous"&&!l.outer_follows&&Rr(r,c.outer,h,jS)}if(o===null)return r;const a=ai(o,t);if(eE(r,n,o,a,e,i),o.cage==="points"&&nE(r,n,a,Or(o.color),s),t?.operation?.kind==="move_points"&&(t.operation.radius??0)>0){const l=Yr(Dn(a,t.target),t.operation.points);gh(r,qf(l,t.operation.radius,s),$s,qS)}return r}function gm(n){return n.cage==="points"||n.cage==="mesh"}function eE(n,t,e,i,s,r){const o=Or(e.color),a=t.mode==="set",l=e.enabled?1:.4;if(t.grid)for(const d of s)gh(n,d,o,QS);const[c,h]=a?[i.inner,i.deformed]:[i.deformed,i.inner];if(ta(c,h)||Rr(n,h,JS,KS,l),i.outer&&!e.outer_follows){const d=e.kind!=="continuous"?YS:a&&t.cage!=="inner"?$S:pm;Rr(n,i.outer,o.clone().lerp($s,.35),d,l)}if(Rr(n,c,o,e.cage==="lattice"||e.cage==="mesh"?XS:WS,l),Ur(t,e)!==null){gm(e)&&vm(n,c,o);return}for(const{cage:d,posed:u}of mh(t,i)){const p=t.hover?.cage===d?t.hover.part:null;if(p&&u.points===void 0&&iE(n,u.corners,p),p?.ends&&u.points){const[x,m]=p.ends;Da(n,u.points[x],u.points[m],$s,fm)}const g=d==="outer"?t.cage==="outer":!a||t.cage!=="outer";sE(n,u,o,p,g?t.corners:[],g,r)}}function Rr(n,t,e,i,s=1){for(const[r,o]of ch(t))Da(n,r,o,e,i,s)}function vm(n,t,e){for(const i of fi(t))n.dots.push({position:i,color:e,size:6,shape:"round",filled:!0})}function nE(n,t,e,i,s){const r=t.mode==="set"?e.inner:e.deformed;for(const o of fi(r))gh(n,qf(o,r.radius??0,s),i,pm)}function gh(n,t,e,i){for(let s=1;s<t.length;s++)Da(n,t[s-1],t[s],e,i)}function Da(n,t,e,i,s,r=1){n.segments.push({from:t,to:e,srgbColor:i,width:s.width,alpha:s.alpha*r,hiddenAlpha:s.hiddenAlpha*r})}function iE(n,t,e){const i=ga(e);if(e.kind!=="corner")for(const[s,r]of Pa)i.includes(s)&&i.includes(r)&&Da(n,t[s],t[r],$s,fm)}function sE(n,t,e,i,s,r,o){const a=r?9:7;(t.points===void 0?hm(t.corners,o):[]).forEach((c,h)=>{if(c===null)return;const d=i?.kind==="face"&&i.index===h;n.dots.push({position:c,color:d?$s:e,size:d?12:a-1,shape:"square",filled:d})}),fi(t).forEach((c,h)=>{const d=(i?.kind==="corner"||i?.kind==="point")&&i.index===h,u=s.includes(h);n.dots.push({position:c,color:d||u?$s:e,size:d?14:u?12:a,shape:"round",filled:!u||d})})}const ji=new Cf,we=new C,Ci=new C,fe=new ce,Md={X:new C(1,0,0),Y:new C(0,1,0),Z:new C(0,0,1)},_l={type:"change"},Td={type:"mouseDown",mode:null},Ad={type:"mouseUp",mode:null},Cd={type:"objectChange"};class rE extends Rf{constructor(t,e=null){super(void 0,e);const i=new uE(this);this._root=i;const s=new dE;this._gizmo=s,i.add(s);const r=new pE;this._plane=r,i.add(r);const o=this;function a(M,b){let E=b;Object.defineProperty(o,M,{get:function(){return E!==void 0?E:b},set:function(T){E!==T&&(E=T,r[M]=T,s[M]=T,o.dispatchEvent({type:M+"-changed",value:T}),o.dispatchEvent(_l))}}),o[M]=b,r[M]=b,s[M]=b}a("camera",t),a("object",void 0),a("enabled",!0),a("axis",null),a("mode","translate"),a("translationSnap",null),a("rotationSnap",null),a("scaleSnap",null),a("space","world"),a("size",1),this.viewport=null,a("dragging",!1),a("showX",!0),a("showY",!0),a("showZ",!0),a("showXY",!0),a("showYZ",!0),a("showXZ",!0),a("showXYZE",!0),a("showE",!0),a("minX",-1/0),a("maxX",1/0),a("minY",-1/0),a("maxY",1/0),a("minZ",-1/0),a("maxZ",1/0);const l=new C,c=new C,h=new ce,d=new ce,u=new C,p=new ce,g=new C,x=new C,m=new C,f=0,_=new C;a("worldPosition",l),a("worldPositionStart",c),a("worldQuaternion",h),a("worldQuaternionStart",d),a("cameraPosition",u),a("cameraQuaternion",p),a("pointStart",g),a("pointEnd",x),a("rotationAxis",m),a("rotationAngle",f),a("eye",_),this._offset=new C,this._startNorm=new C,this._endNorm=new C,this._cameraScale=new C,this._parentPosition=new C,this._parentQuaternion=new ce,this._parentQuaternionInv=new ce,this._parentScale=new C,this._worldScaleStart=new C,this._worldQuaternionInv=new ce,this._worldScale=new C,this._positionStart=new C,this._quaternionStart=new ce,this._scaleStart=new C,this._getPointer=oE.bind(this),this._onPointerDown=lE.bind(this),this._onPointerHover=aE.bind(this),this._onPointerMove=cE.bind(this),this._onPointerUp=hE.bind(this),e!==null&&this.connect(e)}connect(t){super.connect(t),this.domElement.addEventListener("pointerdown",this._onPointerDown),this.domElement.addEventListener("pointermove",this._onPointerHover),this.domElement.addEventListener("pointerup",this._onPointerUp),this.domElement.style.touchAction="none"}disconnect(){this.domElement.removeEventListener("pointerdown",this._onPointerDown),this.domElement.removeEventListener("pointermove",this._onPointerHover),this.domElement.removeEventListener("pointermove",this._onPointerMove),this.domElement.removeEventListener("pointerup",this._onPointerUp),this.domElement.style.touchAction=""}getHelper(){return this._root}pointerHover(t){if(this.object===void 0||this.dragging===!0)return;t!==null&&ji.setFromCamera(t,this.camera);const e=xl(this._gizmo.picker[this.mode],ji);e?this.axis=e.object.name:this.axis=null}pointerDown(t){if(!(this.object===void 0||this.dragging===!0||t!=null&&t.button!==0)&&this.axis!==null){t!==null&&ji.setFromCamera(t,this.camera);const e=xl(this._plane,ji,!0);e&&(this.object.updateMatrixWorld(),this.object.parent.updateMatrixWorld(),this._positionStart.copy(this.object.position),this._quaternionStart.copy(this.object.quaternion),this._scaleStart.copy(this.object.scale),this.object.matrixWorld.decompose(this.worldPositionStart,this.worldQuaternionStart,this._worldScaleStart),this.pointStart.copy(e.point).sub(this.worldPositionStart)),this.dragging=!0,Td.mode=this.mode,this.dispatchEvent(Td)}}pointerMove(t){const e=this.axis,i=this.mode,s=this.object;let r=this.space;if(i==="scale"?r="local":(e==="E"||e==="XYZE"||e==="XYZ")&&(r="world"),s===void 0||e===null||this.dragging===!1||t!==null&&t.button!==-1)return;t!==null&&ji.setFromCamera(t,this.camera);const o=xl(this._plane,ji,!0);if(o){if(this.pointEnd.copy(o.point).sub(this.worldPositionStart),i==="translate")this._offset.copy(this.pointEnd).sub(this.pointStart),r==="local"&&e!=="XYZ"&&this._offset.applyQuaternion(this._worldQuaternionInv),e.indexOf("X")===-1&&(this._offset.x=0),e.indexOf("Y")===-1&&(this._offset.y=0),e.indexOf("Z")===-1&&(this._offset.z=0),r==="local"&&e!=="XYZ"?this._offset.applyQuaternion(this._quaternionStart).divide(this._parentScale):this._offset.applyQuaternion(this._parentQuaternionInv).divide(this._parentScale),s.position.copy(this._offset).add(this._positionStart),this.translationSnap&&(r==="local"&&(s.position.applyQuaternion(fe.copy(this._quaternionStart).invert()),e.search("X")!==-1&&(s.position.x=Math.round(s.position.x/this.translationSnap)*this.translationSnap),e.search("Y")!==-1&&(s.position.y=Math.round(s.position.y/this.translationSnap)*this.translationSnap),e.search("Z")!==-1&&(s.position.z=Math.round(s.position.z/this.translationSnap)*this.translationSnap),s.position.applyQuaternion(this._quaternionStart)),r==="world"&&(s.getWorldPosition(we),e.search("X")!==-1&&(we.x=Math.round(we.x/this.translationSnap)*this.translationSnap),e.search("Y")!==-1&&(we.y=Math.round(we.y/this.translationSnap)*this.translationSnap),e.search("Z")!==-1&&(we.z=Math.round(we.z/this.translationSnap)*this.translationSnap),s.position.copy(s.parent.worldToLocal(we)))),s.position.x=Math.max(this.minX,Math.min(this.maxX,s.position.x)),s.position.y=Math.max(this.minY,Math.min(this.maxY,s.position.y)),s.position.z=Math.max(this.minZ,Math.min(this.maxZ,s.position.z));else if(i==="scale"){if(e.search("XYZ")!==-1){let a=this.pointEnd.length()/this.pointStart.length();this.pointEnd.dot(this.pointStart)<0&&(a*=-1),Ci.set(a,a,a)}else we.copy(this.pointStart),Ci.copy(this.pointEnd),we.applyQuaternion(this._worldQuaternionInv),Ci.applyQuaternion(this._worldQuaternionInv),Ci.divide(we),e.search("X")===-1&&(Ci.x=1),e.search("Y")===-1&&(Ci.y=1),e.search("Z")===-1&&(Ci.z=1);s.scale.copy(this._scaleStart).multiply(Ci),this.scaleSnap&&(e.search("X")!==-1&&(s.scale.x=Math.round(s.scale.x/this.scaleSnap)*this.scaleSnap||this.scaleSnap),e.search("Y")!==-1&&(s.scale.y=Math.round(s.scale.y/this.scaleSnap)*this.scaleSnap||this.scaleSnap),e.search("Z")!==-1&&(s.scale.z=Math.round(s.scale.z/this.scaleSnap)*this.scaleSnap||this.scaleSnap))}else if(i==="rotate"){this._offset.copy(this.pointEnd).sub(this.pointStart);const a=20/this.worldPosition.distanceTo(we.setFromMatrixPosition(this.camera.matrixWorld));let l=!1;e==="XYZE"?(this.rotationAxis.copy(this._offset).cross(this.eye).normalize(),this.rotationAngle=this._offset.dot(we.copy(this.rotationAxis).cross(this.eye))*a):(e==="X"||e==="Y"||e==="Z")&&(this.rotationAxis.copy(Md[e]),we.copy(Md[e]),r==="local"&&we.applyQuaternion(this.worldQuaternion),we.cross(this.eye),we.length()===0?l=!0:this.rotationAngle=this._offset.dot(we.normalize())*a),(e==="E"||l)&&(this.rotationAxis.copy(this.eye),this.rotationAngle=this.pointEnd.angleTo(this.pointStart),this._startNorm.copy(this.pointStart).normalize(),this._endNorm.copy(this.pointEnd).normalize(),this.rotationAngle*=this._endNorm.cross(this._startNorm).dot(this.eye)<0?1:-1),this.rotationSnap&&(this.rotationAngle=Math.round(this.rotationAngle/this.rotationSnap)*this.rotationSnap),r==="local"&&e!=="E"&&e!=="XYZE"?(s.quaternion.copy(this._quaternionStart),s.quaternion.multiply(fe.setFromAxisAngle(this.rotationAxis,this.rotationAngle)).normalize()):(this.rotationAxis.applyQuaternion(this._parentQuaternionInv),s.quaternion.copy(fe.setFromAxisAngle(this.rotationAxis,this.rotationAngle)),s.quaternion.multiply(this._quaternionStart).normalize())}this.dispatchEvent(_l),this.dispatchEvent(Cd)}}pointerUp(t){t!==null&&t.button!==0||(this.dragging&&this.axis!==null&&(Ad.mode=this.mode,this.dispatchEvent(Ad)),this.dragging=!1,this.axis=null)}dispose(){this.disconnect(),this._root.dispose()}attach(t){return this.object=t,this._root.visible=!0,this}detach(){return this.object=void 0,this.axis=null,this._root.visible=!1,this}reset(){this.enabled&&this.dragging&&(this.object.position.copy(this._positionStart),this.object.quaternion.copy(this._quaternionStart),this.object.scale.copy(this._scaleStart),this.dispatchEvent(_l),this.dispatchEvent(Cd),this.pointStart.copy(this.pointEnd))}getRaycaster(){return ji}getMode(){return this.mode}setMode(t){this.mode=t}setTranslationSnap(t){this.translationSnap=t}setRotationSnap(t){this.rotationSnap=t}setScaleSnap(t){this.scaleSnap=t}setSize(t){this.size=t}setSpace(t){this.space=t}setColors(t,e,i,s){const r=this._gizmo.materialLib;r.xAxis.color.set(t),r.yAxis.color.set(e),r.zAxis.color.set(i),r.active.color.set(s),r.xAxisTransparent.color.set(t),r.yAxisTransparent.color.set(e),r.zAxisTransparent.color.set(i),r.activeTransparent.color.set(s),r.xAxis._color&&r.xAxis._color.set(t),r.yAxis._color&&r.yAxis._color.set(e),r.zAxis._color&&r.zAxis._color.set(i),r.active._color&&r.active._color.set(s),r.xAxisTransparent._color&&r.xAxisTransparent._color.set(t),r.yAxisTransparent._color&&r.yAxisTransparent._color.set(e),r.zAxisTransparent._color&&r.zAxisTransparent._color.set(i),r.activeTransparent._color&&r.activeTransparent._color.set(s)}}function oE(n){if(this.domElement.ownerDocument.pointerLockElement)return{x:0,y:0,button:n.button};{const t=this.domElement.getBoundingClientRect(),e=this.viewport;let i,s,r,o;return e!==null?(i=e.x,s=t.height-e.y-e.w,r=e.z,o=e.w):(i=0,s=0,r=t.width,o=t.height),{x:(n.clientX-t.left-i)/r*2-1,y:-(n.clientY-t.top-s)/o*2+1,button:n.button}}}function aE(n){if(this.enabled)switch(n.pointerType){case"mouse":case"pen":this.pointerHover(this._getPointer(n));break}}function lE(n){this.enabled&&(document.pointerLockElement||this.domElement.setPointerCapture(n.pointerId),this.domElement.addEventListener("pointermove",this._onPointerMove),this.pointerHover(this._getPointer(n)),this.pointerDown(this._getPointer(n)))}function cE(n){this.enabled&&this.pointerMove(this._getPointer(n))}function hE(n){this.enabled&&(this.domElement.releasePointerCapture(n.pointerId),this.domElement.removeEventListener("pointermove",this._onPointerMove),this.pointerUp(this._getPointer(n)))}function xl(n,t,e){const i=t.intersectObject(n,!0);for(let s=0;s<i.length;s++)if(i[s].object.visible||e)return i[s];return!1}const ko=new Kn,le=new C(0,1,0),Rd=new C(0,0,0),Pd=new Yt,Bo=new ce,na=new ce,Bn=new C,ba=new Yt,wr=new C(1,0,0),Ji=new C(0,1,0),yr=new C(0,0,1),zo=new C,dr=new C,pr=new C;class uE extends Ne{constructor(t){super(),this.isTransformControlsRoot=!0,this.controls=t,this.visible=!1}updateMatrixWorld(t){const e=this.controls;e.object!==void 0&&(e.object.updateMatrixWorld(),e.object.parent===null?console.error("TransformControls: The attached 3D object must be a part of the scene graph."):e.object.parent.matrixWorld.decompose(e._parentPosition,e._parentQuaternion,e._parentScale),e.object.matrixWorld.decompose(e.worldPosition,e.worldQuaternion,e._worldScale),e._parentQuaternionInv.copy(e._parentQuaternion).invert(),e._worldQuaternionInv.copy(e.worldQuaternion).invert()),e.camera.updateMatrixWorld(),e.camera.matrixWorld.decompose(e.cameraPosition,e.cameraQuaternion,e._cameraScale),e.camera.isOrthographicCamera?e.camera.getWorldDirection(e.eye).negate():e.eye.copy(e.cameraPosition).sub(e.worldPosition).normalize(),this.parent&&(ba.copy(this.parent.matrixWorld).invert(),ba.decompose(this.position,this.quaternion,this.scale)),super.updateMatrixWorld(t)}dispose(){this.traverse(function(t){t.geometry&&t.geometry.dispose(),t.material&&t.material.dispose()})}}class dE extends Ne{constructor(){super(),this.isTransformControlsGizmo=!0,this.type="TransformControlsGizmo";const t=new ih({depthTest:!1,depthWrite:!1,fog:!1,toneMapped:!1,transparent:!0}),e=new bf({depthTest:!1,depthWrite:!1,fog:!1,toneMapped:!1,transparent:!0}),i=t.clone();i.opacity=.15;const s=e.clone();s.opacity=.5;const r=t.clone();r.color.setHex(16711680);const o=t.clone();o.color.setHex(65280);const a=t.clone();a.color.setHex(255);const l=t.clone();l.color.setHex(16711680),l.opacity=.5;const c=t.clone();c.color.setHex(65280),c.opacity=.5;const h=t.clone();h.color.setHex(255),h.opacity=.5;const d=t.clone();d.opacity=.25;const u=t.clone();u.color.setHex(16776960),u.opacity=.25;const p=t.clone();p.color.setHex(16776960);const g=t.clone();g.color.setHex(7895160),this.materialLib={xAxis:r,yAxis:o,zAxis:a,active:p,xAxisTransparent:l,yAxisTransparent:c,zAxisTransparent:h,activeTransparent:u};const x=new Ze(0,.04,.1,12);x.translate(0,.05,0);const m=new Ce(.08,.08,.08);m.translate(0,.04,0);const f=new Ve;f.setAttribute("position",new me([0,0,0,1,0,0],3));const _=new Ze(.0075,.0075,.5,3);_.translate(0,.25,0);function M(z,$){const k=new ts(z,.0075,3,64,$*Math.PI*2);return k.rotateY(Math.PI/2),k.rotateX(Math.PI/2),k}function b(){const z=new Ve;return z.setAttribute("position",new me([0,0,0,1,1,1],3)),z}const E={X:[[new _t(x,r),[.5,0,0],[0,0,-Math.PI/2]],[new _t(x,r),[-.5,0,0],[0,0,Math.PI/2]],[new _t(_,r),[0,0,0],[0,0,-Math.PI/2]]],Y:[[new _t(x,o),[0,.5,0]],[new _t(x,o),[0,-.5,0],[Math.PI,0,0]],[new _t(_,o)]],Z:[[new _t(x,a),[0,0,.5],[Math.PI/2,0,0]],[new _t(x,a),[0,0,-.5],[-Math.PI/2,0,0]],[new _t(_,a),null,[Math.PI/2,0,0]]],XYZ:[[new _t(new Ls(.1,0),d),[0,0,0]]],XY:[[new _t(new Ce(.15,.15,.01),h),[.15,.15,0]]],YZ:[[new _t(new Ce(.15,.15,.01),l),[0,.15,.15],[0,Math.PI/2,0]]],XZ:[[new _t(new Ce(.15,.15,.01),c),[.15,0,.15],[-Math.PI/2,0,0]]]},T={X:[[new _t(new Ze(.2,0,.6,4),i),[.3,0,0],[0,0,-Math.PI/2]],[new _t(new Ze(.2,0,.6,4),i),[-.3,0,0],[0,0,Math.PI/2]]],Y:[[new _t(new Ze(.2,0,.6,4),i),[0,.3,0]],[new _t(new Ze(.2,0,.6,4),i),[0,-.3,0],[0,0,Math.PI]]],Z:[[new _t(new Ze(.2,0,.6,4),i),[0,0,.3],[Math.PI/2,0,0]],[new _t(new Ze(.2,0,.6,4),i),[0,0,-.3],[-Math.PI/2,0,0]]],XYZ:[[new _t(new Ls(.2,0),i)]],XY:[[new _t(new Ce(.2,.2,.01),i),[.15,.15,0]]],YZ:[[new _t(new Ce(.2,.2,.01),i),[0,.15,.15],[0,Math.PI/2,0]]],XZ:[[new _t(new Ce(.2,.2,.01),i),[.15,0,.15],[-Math.PI/2,0,0]]]},v={START:[[new _t(new Ls(.01,2),s),null,null,null,"helper"]],END:[[new _t(new Ls(.01,2),s),null,null,null,"helper"]],DELTA:[[new Ti(b(),s),null,null,null,"helper"]],X:[[new Ti(f,s),[-1e3,0,0],null,[1e6,1,1],"helper"]],Y:[[new Ti(f,s),[0,-1e3,0],[0,0,Math.PI/2],[1e6,1,1],"helper"]],Z:[[new Ti(f,s),[0,0,-1e3],[0,-Math.PI/2,0],[1e6,1,1],"helper"]]},S={XYZE:[[new _t(M(.5,1),g),null,[0,Math.PI/2,0]]],X:[[new _t(M(.5,.5),r)]],Y:[[new _t(M(.5,.5),o),null,[0,0,-Math.PI/2]]],Z:[[new _t(M(.5,.5),a),null,[0,Math.PI/2,0]]],E:[[new _t(M(.75,1),u),null,[0,Math.PI/2,0]]]},N={AXIS:[[new Ti(f,s),[-1e3,0,0],null,[1e6,1,1],"helper"]]},P={XYZE:[[new _t(new oh(.25,10,8),i)]],X:[[new _t(new ts(.5,.1,4,24),i),[0,0,0],[0,-Math.PI/2,-Math.PI/2]]],Y:[[new _t(new ts(.5,.1,4,24),i),[0,0,0],[Math.PI/2,0,0]]],Z:[[new _t(new ts(.5,.1,4,24),i),[0,0,0],[0,0,-Math.PI/2]]],E:[[new _t(new ts(.75,.1,2,24),i)]]},U={X:[[new _t(m,r),[.5,0,0],[0,0,-Math.PI/2]],[new _t(_,r),[0,0,0],[0,0,-Math.PI/2]],[new _t(m,r),[-.5,0,0],[0,0,Math.PI/2]]],Y:[[new _t(m,o),[0,.5,0]],[new _t(_,o)],[new _t(m,o),[0,-.5,0],[0,0,Math.PI]]],Z:[[new _t(m,a),[0,0,.5],[Math.PI/2,0,0]],[new _t(_,a),[0,0,0],[Math.PI/2,0,0]],[new _t(m,a),[0,0,-.5],[-Math.PI/2,0,0]]],XY:[[new _t(new Ce(.15,.15,.01),h),[.15,.15,0]]],YZ:[[new _t(new Ce(.15,.15,.01),l),[0,.15,.15],[0,Math.PI/2,0]]],XZ:[[new _t(new Ce(.15,.15,.01),c),[.15,0,.15],[-Math.PI/2,0,0]]],XYZ:[[new _t(new Ce(.1,.1,.1),d)]]},D={X:[[new _t(new Ze(.2,0,.6,4),i),[.3,0,0],[0,0,-Math.PI/2]],[new _t(new Ze(.2,0,.6,4),i),[-.3,0,0],[0,0,Math.PI/2]]],Y:[[new _t(new Ze(.2,0,.6,4),i),[0,.3,0]],[new _t(new Ze(.2,0,.6,4),i),[0,-.3,0],[0,0,Math.PI]]],Z:[[new _t(new Ze(.2,0,.6,4),i),[0,0,.3],[Math.PI/2,0,0]],[new _t(new Ze(.2,0,.6,4),i),[0,0,-.3],[-Math.PI/2,0,0]]],XY:[[new _t(new Ce(.2,.2,.01),i),[.15,.15,0]]],YZ:[[new _t(new Ce(.2,.2,.01),i),[0,.15,.15],[0,Math.PI/2,0]]],XZ:[[new _t(new Ce(.2,.2,.01),i),[.15,0,.15],[-Math.PI/2,0,0]]],XYZ:[[new _t(new Ce(.2,.2,.2),i),[0,0,0]]]},F={X:[[new Ti(f,s),[-1e3,0,0],null,[1e6,1,1],"helper"]],Y:[[new Ti(f,s),[0,-1e3,0],[0,0,Math.PI/2],[1e6,1,1],"helper"]],Z:[[new Ti(f,s),[0,0,-1e3],[0,-Math.PI/2,0],[1e6,1,1],"helper"]]};function L(z){const $=new Ne;for(const k in z)for(let tt=z[k].length;tt--;){const W=z[k][tt][0].clone(),Q=z[k][tt][1],et=z[k][tt][2],xt=z[k][tt][3],Nt=z[k][tt][4];W.name=k,W.tag=Nt,Q&&W.position.set(Q[0],Q[1],Q[2]),et&&W.rotation.set(et[0],et[1],et[2]),xt&&W.scale.set(xt[0],xt[1],xt[2]),W.updateMatrix();const K=W.geometry.clone();K.applyMatrix4(W.matrix),W.geometry=K,W.renderOrder=1/0,W.position.set(0,0,0),W.rotation.set(0,0,0),W.scale.set(1,1,1),$.add(W)}return $}this.gizmo={},this.picker={},this.helper={},this.add(this.gizmo.translate=L(E)),this.add(this.gizmo.rotate=L(S)),this.add(this.gizmo.scale=L(U)),this.add(this.picker.translate=L(T)),this.add(this.picker.rotate=L(P)),this.add(this.picker.scale=L(D)),this.add(this.helper.translate=L(v)),this.add(this.helper.rotate=L(N)),this.add(this.helper.scale=L(F)),this.picker.translate.visible=!1,this.picker.rotate.visible=!1,this.picker.scale.visible=!1}updateMatrixWorld(t){const i=(this.mode==="scale"?"local":this.space)==="local"?this.worldQuaternion:na;this.gizmo.translate.visible=this.mode==="translate",this.gizmo.rotate.visible=this.mode==="rotate",this.gizmo.scale.visible=this.mode==="scale",this.helper.translate.visible=this.mode==="translate",this.helper.rotate.visible=this.mode==="rotate",this.helper.scale.visible=this.mode==="scale";let s=[];s=s.concat(this.picker[this.mode].children),s=s.concat(this.gizmo[this.mode].children),s=s.concat(this.helper[this.mode].children);for(let r=0;r<s.length;r++){const o=s[r];o.visible=!0,o.rotation.set(0,0,0),o.position.copy(this.worldPosition);let a;if(this.camera.isOrthographicCamera?a=(this.camera.top-this.camera.bottom)/this.camera.zoom:a=this.worldPosition.distanceTo(this.cameraPosition)*Math.min(1.9*Math.tan(Math.PI*this.camera.fov/360)/this.camera.zoom,7),o.scale.set(1,1,1).multiplyScalar(a*this.size/4),o.tag==="helper"){o.visible=!1,o.name==="AXIS"?(o.visible=!!this.axis,this.axis==="X"&&(fe.setFromEuler(ko.set(0,0,0)),o.quaternion.copy(i).multiply(fe),Math.abs(le.copy(wr).applyQuaternion(i).dot(this.eye))>.9&&(o.visible=!1)),this.axis==="Y"&&(fe.setFromEuler(ko.set(0,0,Math.PI/2)),o.quaternion.copy(i).multiply(fe),Math.abs(le.copy(Ji).applyQuaternion(i).dot(this.eye))>.9&&(o.visible=!1)),this.axis==="Z"&&(fe.setFromEuler(ko.set(0,Math.PI/2,0)),o.quaternion.copy(i).multiply(fe),Math.abs(le.copy(yr).applyQuaternion(i).dot(this.eye))>.9&&(o.visible=!1)),this.axis==="XYZE"&&(fe.setFromEuler(ko.set(0,Math.PI/2,0)),le.copy(this.rotationAxis),o.quaternion.setFromRotationMatrix(Pd.lookAt(Rd,le,Ji)),o.quaternion.multiply(fe),o.visible=this.dragging),this.axis==="E"&&(o.visible=!1)):o.name==="START"?(o.position.copy(this.worldPositionStart),o.visible=this.dragging):o.name==="END"?(o.position.copy(this.worldPosition),o.visible=this.dragging):o.name==="DELTA"?(o.position.copy(this.worldPositionStart),o.quaternion.copy(this.worldQuaternionStart),we.set(1e-10,1e-10,1e-10).add(this.worldPositionStart).sub(this.worldPosition).multiplyScalar(-1),we.applyQuaternion(this.worldQuaternionStart.clone().invert()),o.scale.copy(we),o.visible=this.dragging):(o.quaternion.copy(i),this.dragging?o.position.copy(this.worldPositionStart):o.position.copy(this.worldPosition),this.axis&&(o.visible=this.axis.search(o.name)!==-1));continue}o.quaternion.copy(i),this.mode==="translate"||this.mode==="scale"?(o.name==="X"&&Math.abs(le.copy(wr).applyQuaternion(i).dot(this.eye))>.99&&(o.scale.set(1e-10,1e-10,1e-10),o.visible=!1),o.name==="Y"&&Math.abs(le.copy(Ji).applyQuaternion(i).dot(this.eye))>.99&&(o.scale.set(1e-10,1e-10,1e-10),o.visible=!1),o.name==="Z"&&Math.abs(le.copy(yr).applyQuaternion(i).dot(this.eye))>.99&&(o.scale.set(1e-10,1e-10,1e-10),o.visible=!1),o.name==="XY"&&Math.abs(le.copy(yr).applyQuaternion(i).dot(this.eye))<.2&&(o.scale.set(1e-10,1e-10,1e-10),o.visible=!1),o.name==="YZ"&&Math.abs(le.copy(wr).applyQuaternion(i).dot(this.eye))<.2&&(o.scale.set(1e-10,1e-10,1e-10),o.visible=!1),o.name==="XZ"&&Math.abs(le.copy(Ji).applyQuaternion(i).dot(this.eye))<.2&&(o.scale.set(1e-10,1e-10,1e-10),o.visible=!1)):this.mode==="rotate"&&(Bo.copy(i),le.copy(this.eye).applyQuaternion(fe.copy(i).invert()),o.name.search("E")!==-1&&o.quaternion.setFromRotationMatrix(Pd.lookAt(this.eye,Rd,Ji)),o.name==="X"&&(fe.setFromAxisAngle(wr,Math.atan2(-le.y,le.z)),fe.multiplyQuaternions(Bo,fe),o.quaternion.copy(fe)),o.name==="Y"&&(fe.setFromAxisAngle(Ji,Math.atan2(le.x,le.z)),fe.multiplyQuaternions(Bo,fe),o.quaternion.copy(fe)),o.name==="Z"&&(fe.setFromAxisAngle(yr,Math.atan2(le.y,le.x)),fe.multiplyQuaternions(Bo,fe),o.quaternion.copy(fe))),o.visible=o.visible&&(o.name.indexOf("X")===-1||this.showX),o.visible=o.visible&&(o.name.indexOf("Y")===-1||this.showY),o.visible=o.visible&&(o.name.indexOf("Z")===-1||this.showZ),o.visible=o.visible&&(o.name.indexOf("E")===-1||this.showX&&this.showY&&this.showZ),o.visible=o.visible&&(o.name.indexOf("XY")===-1||this.showXY),o.visible=o.visible&&(o.name.indexOf("YZ")===-1||this.showYZ),o.visible=o.visible&&(o.name.indexOf("XZ")===-1||this.showXZ),o.visible=o.visible&&(o.name!=="E"||this.showE),o.visible=o.visible&&(o.name!=="XYZE"||this.showXYZE),o.material._color=o.material._color||o.material.color.clone(),o.material._opacity=o.material._opacity||o.material.opacity,o.material.color.copy(o.material._color),o.material.opacity=o.material._opacity,this.enabled&&this.axis&&(o.name===this.axis?(o.material.color.copy(this.materialLib.active.color),o.material.opacity=1):this.axis.split("").some(function(l){return o.name===l})&&(o.material.color.copy(this.materialLib.active.color),o.material.opacity=1))}super.updateMatrixWorld(t)}}class pE extends _t{constructor(){super(new Vi(1e5,1e5,2,2),new ih({visible:!1,wireframe:!0,side:Gn,transparent:!0,opacity:.1,toneMapped:!1})),this.isTransformControlsPlane=!0,this.type="TransformControlsPlane"}updateMatrixWorld(t){let e=this.space;switch(this.position.copy(this.worldPosition),this.mode==="scale"&&(e="local"),zo.copy(wr).applyQuaternion(e==="local"?this.worldQuaternion:na),dr.copy(Ji).applyQuaternion(e==="local"?this.worldQuaternion:na),pr.copy(yr).applyQuaternion(e==="local"?this.worldQuaternion:na),le.copy(dr),this.mode){case"translate":case"scale":switch(this.axis){case"X":le.copy(this.eye).cross(zo),Bn.copy(zo).cross(le);break;case"Y":le.copy(this.eye).cross(dr),Bn.copy(dr).cross(le);break;case"Z":le.copy(this.eye).cross(pr),Bn.copy(pr).cross(le);break;case"XY":Bn.copy(pr);break;case"YZ":Bn.copy(zo);break;case"XZ":le.copy(pr),Bn.copy(dr);break;case"XYZ":case"E":Bn.set(0,0,0);break}break;case"rotate":default:Bn.set(0,0,0)}Bn.length()===0?this.quaternion.copy(this.cameraQuaternion):(ba.lookAt(we.set(0,0,0),Bn,le),this.quaternion.setFromRotationMatrix(ba)),super.updateMatrixWorld(t)}}const Ld={X:new C(1,0,0),Y:new C(0,1,0),Z:new C(0,0,1)},fE=.02,mE=50;function gE(n,t){return{kind:"translate",by:vh(t.clone().sub(n))}}function vE(n,t,e,i){const s=n.clone().invert().multiply(t),r=Ld[i];if(!(i in Ld))return{kind:"rotate",rotation_deg:Yf(s),axes:e};const o=2*Math.atan2(new C(s.x,s.y,s.z).dot(r),s.w)*(180/Math.PI),a=o>180?o-360:o<=-180?o+360:o;return{kind:"rotate",rotation_deg:vh(r.clone().multiplyScalar(a)),axes:e}}function _E(n,t){return{kind:"scale",by:n.toArray().map(i=>Mn(Math.min(Math.max(i,fE),mE))),axes:t}}function _m(n,t){return{kind:"move_corners",corners:[...n].sort((e,i)=>e-i),by:vh(t)}}function xE(n,t,e){if(n.kind!=="move_corners"||t.points===void 0)return n;const{corners:i,by:s}=n;return e!==null?{kind:"move_points",points:i,by:s,radius:e.radius,falloff:e.curve}:i.length===1?{kind:"move_point",point:i[0],by:s}:{kind:"move_points",points:i,by:s}}function bE(n,t,e){const i=n.direction.dot(e),s=t.clone().sub(n.origin).dot(e)/i;return Math.abs(i)<1e-9||s<0?null:n.at(s,new C)}function Dd(n,t,e){const i=e.clone().cross(n.direction),s=i.lengthSq();if(s<1e-9*e.lengthSq())return null;const r=n.origin.clone().sub(t).cross(n.direction).dot(i)/s;return t.clone().addScaledVector(e,r)}function vh(n){return n.toArray().map(t=>Mn(t))}const wE=2;class yE{constructor(t,e){this.camera=e,this.controls=new rE(e),this.controls.size=.85,this.controls.space="local",this.controls.setColors("#ff4d5e","#7fd13b","#3f8cff","#ffd34d"),t.add(this.proxy,this.controls.getHelper())}proxy=new Ne;controls;start={position:new C,quaternion:new ce,device:{x:0,y:0}};axes="world";compiled=!1;show(t,e,i,s,r=new ce){this.dragging||(this.axes=e,this.controls.mode=s!==null||t==="select"?"translate":t,this.proxy.position.copy(s??new C(...i.pivot)),this.proxy.quaternion.copy(e==="cage"?Hf(i.corners):r),this.proxy.scale.set(1,1,1),this.proxy.updateMatrixWorld(),this.isShown||this.controls.attach(this.proxy))}compile(t){if(this.compiled||!this.isShown||this.dragging)return;this.compiled=!0;const{controls:e}=this,{axis:i}=e;e.axis="Z",e.dragging=!0,t(),e.dragging=!1,e.axis=i}hide(){this.isShown&&!this.dragging&&this.controls.detach()}get isShown(){return this.controls.object!==void 0}get dragging(){return this.controls.dragging}hover(t){return this.isShown?(this.untyped.pointerHover({...t,button:-1}),this.axis):null}clearHover(){this.dragging||(this.controls.axis=null)}get axis(){return this.controls.axis}begin(t){this.start.position.copy(this.proxy.position),this.start.quaternion.copy(this.proxy.quaternion),this.start.device={x:t.x,y:t.y},this.untyped.pointerDown({...t,button:0})}move(t,e){this.untyped.pointerMove({...t,button:-1});const{proxy:i,start:s}=this;switch(this.controls.mode){case"translate":return e.length>0?_m(e,i.position.clone().sub(s.position)):gE(s.position,i.position);case"rotate":return vE(s.quaternion,i.quaternion,this.axes,this.axis??"");case"scale":return _E(this.axis==="XYZ"?this.uniformFactors(t):i.scale,this.axes)}}uniformFactors(t){const{x:e,y:i}=this.start.device,s=Math.exp(wE*((t.x-e)*this.camera.aspect+(t.y-i)));return new C(s,s,s)}moveTo(t){this.proxy.position.copy(t),this.proxy.updateMatrixWorld()}end(t){this.untyped.pointerUp({...t,button:0}),this.controls.axis=null}grip(t,e,i){const s=this.untyped._gizmo.picker[this.controls.mode];this.controls.getHelper().updateMatrixWorld(!0);const r=s.children.filter(l=>l instanceof _t),o=new Cf,a=l=>(o.setFromCamera(new It(l.x,l.y),this.camera),o.intersectObjects(r,!1).find(c=>c.object.visible)?.object.name===t);for(const l of r.filter(c=>c.name===t)){const c=l.geometry.getAttribute("position"),h=Array.from({length:c.count},(u,p)=>new C().fromBufferAttribute(c,p)),d=h.reduce((u,p)=>u.add(p),new C).divideScalar(h.length);for(const u of[d,...h]){const p=u.applyMatrix4(l.matrixWorld).project(this.camera);if(Math.abs(p.x)>.98||Math.abs(p.y)>.98||!i(p))continue;if([-1,0,1].flatMap(x=>[-1,0,1].map(m=>({x:p.x+x*e.x,y:p.y+m*e.y}))).every(a))return{x:p.x,y:p.y}}}return null}get untyped(){return this.controls}}const SE=150;class EE{constructor(t,e){this.ask=t,this.changed=e}edit=0;requestKey="";lines=[];isWaiting=!1;clear(){this.requestKey=""}linesFor(t,{deformed:e,outer:i}){if(t.kind!=="continuous"||i===null||!t.enabled)return[];t.id!==this.edit&&(this.edit=t.id,this.lines=[]);const{inner:s,shell:r,falloff:o,width:a,points:l}=t,c=[l?.radius,l?.falloff,l?.connected],h=JSON.stringify([t.id,fi(e),i.corners,s,r,o,a,c]);return h!==this.requestKey&&!this.isWaiting&&(this.requestKey=h,this.isWaiting=!0,this.ask(t.id).then(d=>{d!==null&&this.edit===t.id&&(this.lines=d.grid),this.changed(),setTimeout(()=>{this.isWaiting=!1,this.changed()},SE)})),this.lines}}const Id=3,ME=.004,TE=2.5,AE=`
uniform vec3 low;
uniform vec3 high;
uniform float edge;
uniform float minPixels;
uniform float viewHeight;
out vec3 world;
void main() {
  world = mix(low, high, position);
  gl_Position = projectionMatrix * viewMatrix * vec4(world, 1.0);
  float covered = edge * projectionMatrix[1][1] * 0.5 * viewHeight / max(gl_Position.w, 1e-6);
  gl_PointSize = max(1.2 * covered, minPixels);
}`,CE=`
uniform sampler2D depthMap;
uniform mat4 pictureProjection;
uniform vec3 pictureEye;
uniform float slack;
in vec3 world;
out vec4 color;
void main() {
  vec4 clip = pictureProjection * vec4(world, 1.0);
  vec2 at = 0.5 + 0.5 * clip.xy / clip.w;
  bool shown = true;
  if (clip.w > 0.0 && all(greaterThan(at, vec2(0.0))) && all(lessThan(at, vec2(1.0)))) {
    float seen = texture(depthMap, vec2(at.x, 1.0 - at.y)).r;
    shown = seen >= ${(.5*Ii).toFixed(1)}
      || length(world - pictureEye) <= seen * ${(1+ME).toFixed(4)} + slack;
  }
  color = shown ? vec4(1.0, 0.0, 0.0, 1.0) : vec4(0.0, 1.0, 0.0, 1.0);
}`,RE=`
void main() { gl_Position = vec4(position.xy, 0.0, 1.0); }`,PE=`
uniform sampler2D mask;
uniform vec2 step_;
out vec4 color;
void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  vec2 here = texelFetch(mask, at, 0).rg;
  float most = here.r;
  float least = here.r;
  for (int i = 0; i < 4; i++) {
    ivec2 by = i < 2 ? ivec2(i * 2 - 1, 0) : ivec2(0, i * 2 - 5);
    float other = texelFetch(mask, clamp(at + by * int(step_.x), ivec2(0), textureSize(mask, 0) - 1), 0).r;
    most = max(most, other);
    least = min(least, other);
  }
  float rim = here.r > 0.5 && least < 0.5 ? 1.0 : 0.0;
  float alpha = here.r > 0.5 ? 0.42 : here.g > 0.5 ? 0.12 : 0.0;
  alpha = max(alpha, 0.95 * rim);
  if (alpha <= 0.0) discard;
  color = vec4(rim > 0.5 ? vec3(1.0, 0.78, 0.25) : vec3(1.0, 0.55, 0.08), alpha);
}`;class LE{constructor(t,e){this.viewport=t,this.pictures=e,this.points=new wf(this.geometry,new dn({vertexShader:AE,fragmentShader:CE,glslVersion:zi,depthTest:!1,depthWrite:!1,transparent:!0,blending:Vp,blendEquation:Hp,blendSrc:kl,blendDst:kl,uniforms:{low:{value:new C},high:{value:new C},edge:{value:0},minPixels:{value:Id},viewHeight:{value:1},depthMap:{value:e.depthTexture},pictureProjection:{value:new Yt},pictureEye:{value:new C},slack:{value:0}}})),this.points.frustumCulled=!1,this.pointScene.add(this.points),this.tint=new _t(new Vi(2,2),new dn({vertexShader:RE,fragmentShader:PE,glslVersion:zi,transparent:!0,depthTest:!1,depthWrite:!1,uniforms:{mask:{value:null},step_:{value:new It(1,1)}}})),this.tint.frustumCulled=!1,this.tint.visible=!1,t.scene.add(this.tint),t.canvas.addEventListener("webglcontextlost",()=>{this.mask?.dispose(),this.mask=null})}geometry=new Ve;points;pointScene=new nh;tint;mask=null;count=0;take(t,e){const i=new Uint16Array(e,0,3*t.count);this.geometry.dispose(),this.geometry.setAttribute("position",new un(i,3,!0)),this.geometry.setDrawRange(0,t.count),this.count=t.count;const{uniforms:s}=this.points.material;s.low.value.set(...t.low),s.high.value.set(...t.high),s.edge.value=t.size,s.slack.value=TE*t.size,this.viewport.invalidate()}get shown(){return this.tint.visible?this.count:0}draw(t){const{viewpoint:e}=this.pictures;if(this.tint.visible=t&&this.count>0&&e!==null,!this.tint.visible||e===null)return;const{renderer:i,camera:s}=this.viewport,{width:r,height:o}=this.viewport.pixels,{uniforms:a}=this.points.material;a.pictureProjection.value.copy(e.viewProjection),a.pictureEye.value.copy(e.eye),a.viewHeight.value=o,a.minPixels.value=Id*i.getPixelRatio();const l=this.sizedMask(r,o);this.tint.material.uniforms.step_.value.setScalar(Math.max(1,Math.round(i.getPixelRatio()))),i.setRenderTarget(l),i.clear(),i.render(this.pointScene,s),i.setRenderTarget(null)}sizedMask(t,e){return this.mask?.width===t&&this.mask.height===e?this.mask:(this.mask?.dispose(),this.mask=new En(t,e,{depthBuffer:!1,minFilter:Se,magFilter:Se,generateMipmaps:!1}),this.tint.material.uniforms.mask.value=this.mask.texture,this.mask)}}const Vo=2048,DE=`
uniform float scale;
in vec4 paint;
in float form;
out vec3 tint;
out float diameter;
flat out float shape;
void main() {
  gl_Position = projectionMatrix * viewMatrix * vec4(position, 1.0);
  gl_Position.z = 0.0;
  diameter = paint.w * scale;
  gl_PointSize = diameter + 2.0;
  tint = paint.rgb;
  shape = form;
}`,IE=`
in vec3 tint;
in float diameter;
flat in float shape;
out vec4 color;
void main() {
  vec2 p = (gl_PointCoord - 0.5) * (diameter + 2.0);
  bool square = shape > 1.5;
  bool filled = mod(shape, 2.0) > 0.5;
  float radius = square ? max(abs(p.x), abs(p.y)) : length(p);
  float inside = clamp(0.5 * diameter - radius + 0.5, 0.0, 1.0);
  float core = clamp(0.5 * diameter - 1.6 - radius + 0.5, 0.0, 1.0);
  vec3 middle = filled ? tint : vec3(0.08, 0.09, 0.1);
  vec3 rim = filled ? vec3(0.08, 0.09, 0.1) : tint;
  if (inside <= 0.0) discard;
  color = vec4(mix(rim, middle, core), inside);
}`;class NE{geometry=new Ve;position=new un(new Float32Array(Vo*3),3);paint=new un(new Float32Array(Vo*4),4);form=new un(new Float32Array(Vo),1);constructor(t){for(const s of[this.position,this.paint,this.form])s.setUsage(hf);this.geometry.setAttribute("position",this.position),this.geometry.setAttribute("paint",this.paint),this.geometry.setAttribute("form",this.form);const e=new dn({vertexShader:DE,fragmentShader:IE,glslVersion:zi,transparent:!0,depthTest:!1,depthWrite:!1,uniforms:{scale:{value:1}}}),i=new wf(this.geometry,e);i.frustumCulled=!1,i.renderOrder=4,t.scene.add(i),t.beforeFrame.push(()=>{e.uniforms.scale.value=t.renderer.getPixelRatio()})}set(t){const e=t.slice(0,Vo);e.forEach((i,s)=>{this.position.setXYZ(s,...i.position),this.paint.setXYZW(s,i.color.r,i.color.g,i.color.b,i.size),this.form.setX(s,(i.shape==="square"?2:0)+(i.filled?1:0))}),this.position.needsUpdate=this.paint.needsUpdate=this.form.needsUpdate=!0,this.geometry.setDrawRange(0,e.length)}}const UE=6,OE=1.25,FE=200,kE=1.5,BE=.3;class zE{pageCost=null;serverCost=null;frames=0;measuredMoving=!1;drawsComplete=!1;recordPage(t,e){this.frames+=1,this.pageCost=Ud(this.pageCost,e/Math.max(1,t))}recordServer(t,e,i){if(this.measuredMoving&&!i)return;const s=i&&!this.measuredMoving?null:this.serverCost;this.serverCost=Ud(s,e/Math.max(1,t)),this.measuredMoving=i}get serverIsFaster(){const{pageCost:t,serverCost:e}=this;return t===null||e===null||this.frames<UE?!1:t>OE*e}chooseComplete(t){const{pageCost:e,serverCost:i}=this;if(e===null)return!1;const s=this.drawsComplete?kE:1,r=e*t<=s*FE;return this.drawsComplete=r||i!==null&&e<=s*i,this.drawsComplete}get summary(){return`this page ${Nd(this.pageCost)}, the server ${Nd(this.serverCost)}`}}function Nd(n){return n===null?"not measured":`${(.001/Math.max(n,1e-9)).toPrecision(2)} million pixels a second`}function Ud(n,t){return n===null?t:n+BE*(t-n)}function VE(n){return Math.min(768,Math.max(96,(n??8)*128))*2**20}const HE=140,GE=200;class WE{constructor(t,e){this.viewport=t,this.send=e,t.cameraChanges.push(()=>{this.changed=!0,this.moving=!0,this.waitForRest()}),t.beforeFrame.push(()=>{this.changed&&!(this.moving&&this.drawnHere())&&this.sendCamera()})}seq=0;viewpoints=new Map;changed=!1;moving=!1;restTimer;held=!1;drawnHere=()=>!1;get resting(){return!this.changed&&!this.moving}restate(){this.moving=!1,this.sendCamera(),this.viewport.invalidate()}viewpoint(t){return this.viewpoints.get(t)??null}waitForRest(){clearTimeout(this.restTimer),this.restTimer=setTimeout(()=>{this.held?this.waitForRest():this.restate()},HE)}sendCamera(){this.changed=!1;const{viewport:t}=this,e=++this.seq;this.viewpoints.set(e,{viewProjection:t.viewProjection,eye:t.camera.position.clone()}),this.viewpoints.delete(e-GE);const{width:i,height:s}=t.pixels;this.send({type:"camera",seq:e,c2w:t.c2w,width:Math.min(4096,Math.max(16,i)),height:Math.min(4096,Math.max(16,s)),fov_y_deg:t.camera.fov,moving:this.moving})}}const Od=2e3;class XE{moves=[];presented=[];lastMove=0;addMove(t,e,i){this.moves.push({drag:t,seq:e,moved:i,lines:null,received:null,decoded:null,presented:null,renderMs:0,encodeMs:0,width:0}),this.moves.length>Od&&this.moves.shift()}finishLines(t){for(let e=this.moves.length-1;e>=0&&this.moves[e].lines===null;e--)this.moves[e].lines=t}addPresented(t,e,i,s,r){if(this.presented.push(t),this.presented.length>Od&&this.presented.shift(),t.drag===0)return;const o=this.moves.find(a=>a.drag===t.drag&&a.seq===t.seq);o?.presented===null&&(this.lastMove=t.time-o.moved,Object.assign(o,{received:e,decoded:i,presented:t.time,renderMs:s,encodeMs:r,width:t.fullWidth}))}frameRate(t){const e=this.presented.filter(i=>t-i.time<2e3);return e.length<2?0:(e.length-1)*1e3/Math.max(1,e[e.length-1].time-e[0].time)}}function qE(n){const t=new DataView(n).getUint32(0,!0);return{header:JSON.parse(new TextDecoder().decode(new Uint8Array(n,4,t))),start:4+t}}function $E(n,t,e){const i=new Uint8Array(n,e,t.picture_bytes),s=e+t.picture_bytes;return{header:t,picture:i,depth:new Uint16Array(n.slice(s,s+t.depth_bytes))}}async function YE(n,t){if(n.format==="jpeg")return createImageBitmap(new Blob([t.slice()]),{colorSpaceConversion:"none"});const e=new ImageData(n.width,n.height);for(let i=0,s=0;i<t.length;i+=3,s+=4)e.data[s]=t[i],e.data[s+1]=t[i+1],e.data[s+2]=t[i+2],e.data[s+3]=255;return e}class KE{constructor(t,e){this.intervalMs=t,this.forward=e}lastTime=-1/0;timer;get isDue(){return performance.now()>=this.lastTime+this.intervalMs}put(t,e=!1){clearTimeout(this.timer);const i=e?0:this.lastTime+this.intervalMs-performance.now();i>0?this.timer=setTimeout(()=>this.forwardNow(t),i):this.forwardNow(t)}forwardNow(t){this.lastTime=performance.now(),this.forward(t)}}const ZE=300,jE=.5;class QE{constructor(t){this.host=t;const{viewport:e,store:i}=t;this.figures=new KE(ZE,s=>i.set({figures:s})),e.orbitGuessed.push(()=>this.awaitOrbitCenter()),e.afterFrame.push(s=>this.finishFrame(s))}latency=new XE;beforeRequest=[];last=null;lastNews=0;decoding=Promise.resolve();undrawn=[];drawn=[];acknowledged=[];orbitFrom=null;figures;nextFigures=null;add(t,e,i){this.last=t,this.lastNews=performance.now(),this.setOrbitCenter(t.camera),this.drawn.push({header:t,received:e,decoded:i})}acknowledge(t){this.acknowledged.push(...t)}take(t,e,i){const s=performance.now(),{picture:r,depth:o}=$E(t,e,i),a=YE(e,r);this.decoding=this.decoding.then(async()=>{try{this.show(e,await a,o,s)}catch{this.host.say("a picture from the server could not be decoded","warning"),this.host.send({type:"presented",picture:e.picture})}})}requestNext(){const{host:t}=this;this.nextFigures!==null&&this.figures.isDue&&(this.figures.put(this.nextFigures),this.nextFigures=null);const e=[...this.undrawn.map(({header:i})=>i.picture),...this.acknowledged];if(e.length>0){const i=t.isDragging()&&this.acknowledged.length===0;setTimeout(()=>{for(const r of this.beforeRequest)r();for(const r of e)t.send({type:"presented",picture:r})},i?jE*t.viewport.frameTime:0)}this.drawn.push(...this.undrawn),this.undrawn=[],this.acknowledged=[]}show(t,e,i,s){const{host:r}=this,o=performance.now();r.recordServerFrame(t),r.supersedes(t)?(e instanceof ImageBitmap&&e.close(),r.viewport.invalidate(),this.acknowledge([t.picture])):(r.pictures.show(t,e,i,r.camera.viewpoint(t.camera)),this.setOrbitCenter(t.camera),this.last=t,this.undrawn.push({header:t,received:s,decoded:o})),this.lastNews=performance.now()}awaitOrbitCenter(){const{store:t,viewport:e,camera:i}=this.host,{hello:s}=t.now;if(s===null)return;const[r,o]=s.bounds,a=e.camera.position.toArray().every((l,c)=>r[c]<l&&l<o[c]);this.orbitFrom=a?i.seq+1:null}setOrbitCenter(t){const{pictures:e,viewport:i}=this.host;if(this.orbitFrom===null||t<this.orbitFrom||t!==this.host.camera.seq)return;const s=e.depth.at(.5,.5);s!==null&&(i.orbitAt(s),this.orbitFrom=null)}finishFrame(t){this.latency.finishLines(t);const{drawn:e}=this;this.drawn=[];for(const i of e)this.record(i)}record({header:t,received:e,decoded:i}){const s=performance.now(),{drag:r,seq:o,camera:a,revision:l,width:c,full_width:h,full_height:d,whole:u,final:p}=t,{render_ms:g,encode_ms:x}=t,m={time:s,drag:r,seq:o,camera:a,revision:l,width:c,fullWidth:h,whole:u,final:p};this.latency.addPresented(m,e,i,g,x);const f={perSecond:this.latency.frameRate(s),renderMs:g,encodeMs:x,width:h,height:d,whole:u,final:p,page:t.picture===0};this.nextFigures=this.host.isDragging()&&!p?f:null,this.nextFigures===null&&this.figures.put(f,p)}}const bl=[1,.75,.5,.35,.25,.18,.12],JE=.25,tM=16,eM=4,nM=.3;class iM{constructor(t=28,e=40){this.frameBudget=t,this.bandBudget=e}cost=null;record(t,e){const i=e/Math.max(1,t);this.cost=this.cost===null?i:this.cost+nM*(i-this.cost)}scale(t,e){const{cost:i}=this;if(i===null)return JE;const s=r=>i*t*e*r*r<=this.frameBudget;return bl.find(s)??bl[bl.length-1]}bandRows(t,e){if(this.cost===null)return tM;const i=Math.floor(this.bandBudget/Math.max(1e-9,this.cost*t));return Math.max(eM,Math.min(e,i))}}const xm=60,sM=400;class rM{changedAt=-1/0;nextRow=0;complete=!1;restart(t,e){this.changedAt=t,this.nextRow=0,this.complete=e}get isComplete(){return this.complete}nextBand(t,e,i,s=xm){return this.complete||t-this.changedAt<s?null:{first:this.nextRow,count:Math.min(i,e-this.nextRow)}}finishBand({first:t,count:e},i){return this.nextRow=t+e,this.complete=this.nextRow>=i,this.complete}}const Ho={view:[],edits:null};function oM({viewport:n,store:t},e,i){const{view:s,before:r,split:o}=t.now,{width:a,height:l}=n.pixels;return{view:[...n.viewProjection.elements,a,l,s,r,o,e],edits:i}}function bm(n,t){return n.view.length===t.view.length&&n.view.every((e,i)=>e===t.view[i])}function aM(n,t){return t.edits===null||n.edits===null?!1:t.edits.header.revision===n.edits.header.revision&&bm(n,t)}function lM(n,t,e,i,s){const{view:r,before:o,split:a}=e.now;if(n===null||n.picture===0||i===null||!t.resting||n.camera!==t.seq)return!1;const{drag:l,revision:c}=i.header;return n.view===r&&n.before===o&&n.split===a&&n.drag===l&&n.revision>=c&&(n.final||!s)}function cM(n,t,e,i,s,r){const o=s&&e?.header.final===!0,{view:a,before:l,split:c}=t.now,{drag:h,seq:d,revision:u}=e?.header??{drag:0,seq:0,revision:0},[p,g]=i;return{type:"picture",picture:0,camera:n.seq,drag:h,seq:d,revision:u,view:a,before:l,split:c,x:0,y:0,width:p,height:g,full_width:p,full_height:g,whole:s,refinement:o?3:0,final:o,format:"rgb",picture_bytes:0,depth_bytes:0,depth_width:0,depth_height:0,depth_scale:1,render_ms:r,encode_ms:0}}class Fr{constructor(t,e,i,s){this.vertices=t,this.brick=e,this.low=i,this.dims=s;const r=e**3,{bricks:o,masks:a}=t;this.storedBricks=new Int32Array(o.length).fill(-1),this.slots=new Int32Array(a.length/(r/8)*r).fill(-1);let l=0;o.forEach((h,d)=>{h&&(this.storedBricks[d]=l++)});let c=0;for(let h=0;h<this.slots.length;h++)a[h>>3]>>(h&7)&1&&(this.slots[h]=c++)}slots;storedBricks;static fromLevel(t){const{brick:e}=t.field;return new Fr(t,e,[0,0,0],t.header.resolution.map(i=>Math.ceil(i/e)))}slot(t,e,i){const{brick:s,low:r,dims:o}=this,a=Math.floor(t/s)-r[0],l=Math.floor(e/s)-r[1],c=Math.floor(i/s)-r[2];if(a<0||l<0||c<0||a>=o[0]||l>=o[1]||c>=o[2])return-1;const h=this.storedBricks[(a*o[1]+l)*o[2]+c];return h<0?-1:this.slots[((h*s+t%s)*s+e%s)*s+i%s]}}class rs extends Error{}function wl(n,t,e=0){const i=n.field.brick,s=i+1,r=n.header.resolution.map(x=>Math.ceil((x-1)/i)),o=hM(n,r),a=Math.min(255,Math.floor(t/s)),l=o.length+e,c=Math.min(a,Math.max(1,Math.ceil(Math.cbrt(l)))),h=Math.min(a,Math.max(1,Math.ceil(Math.sqrt(l/c)))),d=Math.max(1,Math.ceil(l/(c*h)));if(d>a)throw new rs(`${l} bricks do not fit into textures of ${t} texels an edge`);const u=new Uint8Array(4*r[0]*r[1]*r[2]),p=[c,h,d];for(const[x,m]of o.entries())u.set(_h(x,p),4*m);const g=Math.ceil(3*n.header.steps.length/4);return{brick:i,edge:s,dims:r,atlasBricks:p,count:o.length,index:u,bricks:o,colorTextures:g}}function _h(n,[t,e]){return[n%t,Math.floor(n/t)%e,Math.floor(n/(t*e)),255]}function Lc({atlasBricks:n,edge:t,colorTextures:e,index:i}){return n[0]*n[1]*n[2]*t**3*(2+4*e)+i.length}function hM(n,t){const{codes:e,dims:i}=n.occupancy,s=n.field.brick/4,r=new Uint8Array(t[0]*t[1]*t[2]);let o=0;for(let a=0;a<i[0];a++)for(let l=0;l<i[1];l++)for(let c=0;c<i[2];c++,o++)e[o]<256&&(r[(Math.floor(a/s)*t[1]+Math.floor(l/s))*t[2]+Math.floor(c/s)]=1);return Int32Array.from(r.keys()).filter(a=>r[a]===1)}class wm{constructor(t,e){this.layout=t,this.sources=e}texels(t,e,i){const{edge:s,colorTextures:r,brick:o,dims:a}=this.layout,l=e*i*s**3,c={density:new Uint16Array(l),colors:Array.from({length:r},()=>new Uint8Array(4*l).fill(128))},h=e*s,d=h*i*s;for(let u=0;u<t.length;u++){const p=t[u],g=[Math.floor(p/(a[1]*a[2])),Math.floor(p/a[2])%a[1],p%a[2]],x=u%e*s+Math.floor(u/e)*s*h;for(let m=0;m<s;m++)for(let f=0;f<s;f++)for(let _=0;_<s;_++)this.putTexel(c,x+m*d+f*h+_,g[0]*o+m,g[1]*o+f,g[2]*o+_)}return c}putTexel(t,e,i,s,r){for(const o of this.sources){const a=o.slot(i,s,r);if(a<0)continue;const{density:l,sh:c}=o.vertices,h=c.length/l.length;t.density[e]=l[a];for(let d=0;d<h;d++)t.colors[d>>2][4*e+(d&3)]=c[d*l.length+a];return}}}function xh(n){return Object.entries(n).map(([t,e])=>`#define ${t} ${e}`).join(`
`)}function Fs(n,t,e){const i=performance.now(),s=n.createProgram();for(const[a,l]of[[n.VERTEX_SHADER,t],[n.FRAGMENT_SHADER,e]]){const c=n.createShader(a);if(c===null)throw new Error("the GPU's context is lost");n.shaderSource(c,l),n.compileShader(c),n.attachShader(s,c),n.deleteShader(c)}if(n.linkProgram(s),!n.getProgramParameter(s,n.LINK_STATUS)&&!n.isContextLost()){const l=(n.getAttachedShaders(s)??[]).map(c=>n.getShaderInfoLog(c)??"");throw new Error(`a shader does not compile: ${l.join(" ")} ${n.getProgramInfoLog(s)??""}`)}const r=new Map;return{program:s,uniform:a=>{const l=r.get(a);if(l!==void 0)return l;const c=n.getUniformLocation(s,a);return r.set(a,c),c},milliseconds:performance.now()-i}}class bh extends Error{constructor(){super("the GPU has not enough memory for the field")}}function Ia(n){for(let t=n.getError();t!==n.NO_ERROR&&t!==n.CONTEXT_LOST_WEBGL;t=n.getError())if(t===n.OUT_OF_MEMORY)throw new bh}function ks(n,t,e,i){const s=n.createTexture();n.bindTexture(n.TEXTURE_3D,s),n.texStorage3D(n.TEXTURE_3D,1,t,e[0],e[1],e[2]),Na(n,n.TEXTURE_3D,i);try{Ia(n)}catch(r){throw n.deleteTexture(s),r}return s}function Na(n,t,e){n.texParameteri(t,n.TEXTURE_MIN_FILTER,e),n.texParameteri(t,n.TEXTURE_MAG_FILTER,e);for(const i of t===n.TEXTURE_3D?[n.TEXTURE_WRAP_S,n.TEXTURE_WRAP_T,n.TEXTURE_WRAP_R]:[n.TEXTURE_WRAP_S,n.TEXTURE_WRAP_T])n.texParameteri(t,i,n.CLAMP_TO_EDGE)}function mi(n){n.bindBuffer(n.PIXEL_UNPACK_BUFFER,null),n.pixelStorei(n.UNPACK_ALIGNMENT,1),n.pixelStorei(n.UNPACK_FLIP_Y_WEBGL,!1),n.pixelStorei(n.UNPACK_PREMULTIPLY_ALPHA_WEBGL,!1),n.pixelStorei(n.UNPACK_COLORSPACE_CONVERSION_WEBGL,n.NONE);for(const t of[n.UNPACK_ROW_LENGTH,n.UNPACK_IMAGE_HEIGHT,n.UNPACK_SKIP_PIXELS,n.UNPACK_SKIP_ROWS,n.UNPACK_SKIP_IMAGES])n.pixelStorei(t,0)}function wh(n,t){return n.getParameter(t)??16384}const Xn={BOX_VECTOR:0,LATTICE_VECTOR:2,TO_NODES_VECTOR:3,NODE_BOX_VECTOR:6,FIRST_SCALAR:0,LAST_SCALAR:1,RESOLUTION_SCALAR:2,CONTINUOUS_SCALAR:3,SIMPLE_SCALAR:4,UNDER_SCALAR:5,NODE_SCALAR:6,PART_SCALAR:7,HEXAHEDRON:8,MATRIX_VECTOR:0,CENTER_VECTOR:3,Y_BOX_VECTOR:4,BEND_VECTOR:6,IMAGE_VECTOR:10,AFFINE_SCALAR:0,HEXAHEDRON_ROWS:18,GRADE_SCALARS:9,GRADE_DENSITY:9,GRADE_INNER:10,GRADE_OUTER:22,GRADE_COUNT:34,GRADE_FIRST_PART:17,EDIT_ROWS:44,BOX_ROWS:2,MAX_ROWS:1024,NODES_PER_TEXTURE_ROW:2048,EDGE:1e-6},ym={BLUR:.3,SLOPE_BLUR:.02,ALPHA_MIN:.00392156862745098,ALPHA_MAX:.99,LEAST_COMPENSATION:.005},uM=`
${xh(Xn)}
layout(std140) uniform Edits { vec4 rows[MAX_ROWS]; };
uniform sampler2D lattice;
uniform int editCount;
uniform int boxCount;
uniform bool preserveOpacity;

float largest(vec3 v) { return max(max(v.x, v.y), v.z); }

bool inBox(vec3 p, vec3 low, vec3 high) { return all(greaterThanEqual(p, low)) && all(lessThanEqual(p, high)); }

vec3 times(int at, vec3 v) { return vec3(dot(rows[at].xyz, v), dot(rows[at + 1].xyz, v), dot(rows[at + 2].xyz, v)); }

#ifdef BENT
vec3 solveColumns(vec3 u, vec3 v, vec3 w, vec3 r) {
  vec3 vw = cross(v, w);
  float det = dot(u, vw);
  if (abs(det) < 1e-6) det = det >= 0.0 ? 1e-6 : -1e-6;
  return vec3(dot(r, vw), dot(u, cross(r, w)), dot(u, cross(v, r))) / det;
}

vec3 bendSolve(int at, vec3 xi, vec3 r) {
  vec3 a = rows[at].xyz;
  vec3 b = rows[at + 1].xyz;
  vec3 c = rows[at + 2].xyz;
  vec3 g = rows[at + 3].xyz;
  return solveColumns(
    vec3(1.0, 0.0, 0.0) + xi.y * a + xi.z * b + xi.y * xi.z * g,
    vec3(0.0, 1.0, 0.0) + xi.x * a + xi.z * c + xi.x * xi.z * g,
    vec3(0.0, 0.0, 1.0) + xi.x * b + xi.y * c + xi.x * xi.y * g,
    r
  );
}

vec3 bent(int at, vec3 xi) {
  return xi + xi.x * xi.y * rows[at].xyz + xi.x * xi.z * rows[at + 1].xyz + xi.y * xi.z * rows[at + 2].xyz
    + xi.x * xi.y * xi.z * rows[at + 3].xyz;
}
#endif

// Coordinates in the hexahedron at a row, clamped to [-1,1]^3, and the distance by which they were outside.
vec3 hexahedron(vec3 p, int at, out float error) {
  vec3 y = times(at + MATRIX_VECTOR, p - rows[at + CENTER_VECTOR].xyz);
  vec3 xi = y;
  error = 0.0;
#ifdef BENT
  if (rows[at + AFFINE_SCALAR].w < 0.5) {
    if (inBox(y, rows[at + Y_BOX_VECTOR].xyz, rows[at + Y_BOX_VECTOR + 1].xyz)) {
      xi = clamp(y, -1.0, 1.0);
      for (int n = 0; n < 16; n++) {
        vec3 next = clamp(xi - bendSolve(at + BEND_VECTOR, xi, bent(at + BEND_VECTOR, xi) - y), -1.4, 1.4);
        float by = largest(abs(next - xi));
        xi = next;
        if (by < 1e-4) break;
      }
      error = largest(abs(bent(at + BEND_VECTOR, xi) - y));
      if (error < 2e-6) error = 0.0;
    } else {
      error = 10.0;
    }
  }
#endif
  error += max(largest(abs(xi)) - 1.0, 0.0);
  return clamp(xi, -1.0, 1.0);
}

// Takes p and the direction v to canonical space by the coordinates xi in the hexahedron at a row.
void image(vec3 xi, int at, inout vec3 p, inout vec3 v) {
  vec3 along = times(at + MATRIX_VECTOR, v);
  int c = at + IMAGE_VECTOR;
  vec3 c1 = rows[c + 1].xyz;
  vec3 c2 = rows[c + 2].xyz;
  vec3 c4 = rows[c + 4].xyz;
  p = rows[c].xyz + xi.x * c1 + xi.y * c2 + xi.z * c4;
#ifdef BENT
  if (rows[at + AFFINE_SCALAR].w < 0.5) {
    along = bendSolve(at + BEND_VECTOR, xi, along);
    vec3 c3 = rows[c + 3].xyz;
    vec3 c5 = rows[c + 5].xyz;
    vec3 c6 = rows[c + 6].xyz;
    vec3 c7 = rows[c + 7].xyz;
    p += xi.x * xi.y * c3 + xi.x * xi.z * c5 + xi.y * xi.z * c6 + xi.x * xi.y * xi.z * c7;
    c1 += xi.y * c3 + xi.z * c5 + xi.y * xi.z * c7;
    c2 += xi.x * c3 + xi.z * c6 + xi.x * xi.z * c7;
    c4 += xi.x * c5 + xi.y * c6 + xi.x * xi.y * c7;
  }
#endif
  v = along.x * c1 + along.y * c2 + along.z * c4;
}

vec3 node(int n) { return texelFetch(lattice, ivec2(n & (NODES_PER_TEXTURE_ROW - 1), n >> ${Math.log2(Xn.NODES_PER_TEXTURE_ROW)}), 0).xyz; }

void interpolate(int e, int resolution_, vec3 at, inout vec3 p, inout vec3 v) {
  vec3 s = times(e + TO_NODES_VECTOR, v);
  vec3 g = clamp(at, 0.0, float(resolution_ - 1));
  ivec3 cell = min(ivec3(g), resolution_ - 2);
  vec3 f = g - vec3(cell);
  int plane = resolution_ * resolution_;
  int n = int(rows[e + NODE_SCALAR].w) + (cell.z * resolution_ + cell.y) * resolution_ + cell.x;
  vec3 v000 = node(n);
  vec3 v010 = node(n + resolution_);
  vec3 v001 = node(n + plane);
  vec3 v011 = node(n + plane + resolution_);
  vec3 x00 = node(n + 1) - v000;
  vec3 x10 = node(n + resolution_ + 1) - v010;
  vec3 x01 = node(n + plane + 1) - v001;
  vec3 x11 = node(n + plane + resolution_ + 1) - v011;
  vec3 w00 = v000 + f.x * x00;
  vec3 w10 = v010 + f.x * x10;
  vec3 w01 = v001 + f.x * x01;
  vec3 w11 = v011 + f.x * x11;
  vec3 y0 = w10 - w00;
  vec3 y1 = w11 - w01;
  vec3 z0 = w00 + f.y * y0;
  vec3 z1 = w01 + f.y * y1;
  vec3 x0 = x00 + f.y * (x10 - x00);
  vec3 x1 = x01 + f.y * (x11 - x01);
  p += z0 + f.z * (z1 - z0);
  v += s.x * (x0 + f.z * (x1 - x0)) + s.y * (y0 + f.z * (y1 - y0)) + s.z * (z1 - z0);
}

// Maps a sample through the edit whose rows begin at e. Returns the offset along x, in vertices, at which the sample is
// read: 0 in the field, the offset of a layer, or -1 for an empty sample.
int mapEdit(int e, inout vec3 p, inout vec3 v) {
  bool continuous = rows[e + CONTINUOUS_SCALAR].w > 0.5;
  int resolution_ = int(rows[e + RESOLUTION_SCALAR].w);
  int first = e + HEXAHEDRON;
  if (rows[e + SIMPLE_SCALAR].w > 0.5) {
    vec3 y = times(first + MATRIX_VECTOR, p - rows[first + CENTER_VECTOR].xyz);
    if (largest(abs(y)) <= 1.0 + EDGE) {
      image(clamp(y, -1.0, 1.0), first, p, v);
      return 0;
    }
    vec3 at = times(e + TO_NODES_VECTOR, p - rows[e + LATTICE_VECTOR].xyz);
    if (inBox(at, rows[e + NODE_BOX_VECTOR].xyz, rows[e + NODE_BOX_VECTOR + 1].xyz)) interpolate(e, resolution_, at, p, v);
    return 0;
  }
  float error;
  if (rows[e + FIRST_SCALAR].w < 0.5) {
    vec3 xi = hexahedron(p, first, error);
    if (error <= EDGE) {
      image(xi, first, p, v);
      return int(rows[e + PART_SCALAR].w);
    }
  }
  if (rows[e + LAST_SCALAR].w < 1.5) return 0;
  hexahedron(p, first + HEXAHEDRON_ROWS, error);
  if (!continuous) return error <= EDGE ? int(rows[e + UNDER_SCALAR].w) : 0;
  if (error <= EDGE) interpolate(e, resolution_, times(e + TO_NODES_VECTOR, p - rows[e + LATTICE_VECTOR].xyz), p, v);
  return 0;
}

MAP_SAMPLE
#ifdef GRADED
// Number k of the grade of the edit whose rows begin at e.
float gradeNumber(int e, int k) { return rows[e + GRADE_SCALARS + (k < GRADE_FIRST_PART ? k : k + 1)].w; }

vec3 gradeVector(int e, int k) { return vec3(gradeNumber(e, k), gradeNumber(e, k + 1), gradeNumber(e, k + 2)); }

// Coordinates in the frame at number k, without signs, and the distances of its pairs of faces from its center.
vec3 framed(int e, int k, vec3 q, out vec3 half_) {
  vec3 by = q - gradeVector(e, k + 9);
  vec3 x = gradeVector(e, k);
  vec3 y = gradeVector(e, k + 3);
  vec3 z = gradeVector(e, k + 6);
  half_ = 1.0 / vec3(length(x), length(y), length(z));
  return abs(vec3(dot(x, by), dot(y, by), dot(z, by)));
}

float falloffWeight(int e, vec3 q) {
  vec3 h;
  vec3 H;
  vec3 xi = framed(e, GRADE_INNER, q, h);
  if (largest(xi) <= 1.0) return 1.0;
  vec3 z = framed(e, GRADE_OUTER, q, H);
  if (largest(z) >= 1.0) return 0.0;
  vec3 a = h * max(xi - 1.0, 0.0);
  vec3 b = 0.5 * H * max(1.0 - z * z, 1e-6);
  a *= a;
  b *= b;
  float inner = sqrt(sqrt(dot(a, a)));
  float outer = inversesqrt(sqrt(dot(1.0 / b, 1.0 / b)));
  float g = outer / (inner + outer);
  return g * g * (3.0 - 2.0 * g);
}

// The matrix of a sample's color by the edits' grades, and the factor of its density.
mat3 gradeSample(vec3 p, out float density) {
  mat3 colors = mat3(1.0);
  density = 1.0;
  int place = 0;
  vec3 v = vec3(0.0, 0.0, 1.0);
  for (int n = editCount - 1; n >= 0; n--) {
    int e = n * EDIT_ROWS;
    if (place != 0 || !inBox(p, rows[e + BOX_VECTOR].xyz, rows[e + BOX_VECTOR + 1].xyz)) continue;
    bool graded = gradeNumber(e, GRADE_DENSITY) > 0.5;
    bool continuous = rows[e + CONTINUOUS_SCALAR].w > 0.5;
    float weight = 0.0;
    if (graded && !continuous && rows[e + FIRST_SCALAR].w < 0.5) {
      float error;
      hexahedron(p, e + HEXAHEDRON, error);
      if (error <= EDGE) weight = 1.0;
    }
    place = mapEdit(e, p, v);
    if (graded && continuous) weight = falloffWeight(e, p);
    if (weight > 0.0) {
      mat3 step_ = transpose(mat3(gradeVector(e, 0), gradeVector(e, 3), gradeVector(e, 6)));
      colors = colors * (mat3(1.0) + weight * (step_ - mat3(1.0)));
      density *= 1.0 + weight * (gradeNumber(e, GRADE_DENSITY) - 2.0);
    }
  }
  return colors;
}
#endif
// The interval of a ray outside which no edit has an effect.
vec2 editedPart(vec3 origin, vec3 d) {
  vec2 part = vec2(1e30, -1e30);
  vec3 inverse_ = safeInverse(d);
  for (int k = 0; k < boxCount; k++) {
    int at = editCount * EDIT_ROWS + BOX_ROWS * k;
    vec2 through = slab(origin, inverse_, rows[at].xyz, rows[at + 1].xyz);
    if (through.x <= through.y) part = vec2(min(part.x, through.x), max(part.y, through.y));
  }
  return part;
}

vec3 throughEdits(vec3 slope, vec3 p) {
  vec3 result;
  for (int a = 0; a < 3; a++) {
    vec3 q = p;
    vec3 v = vec3(a == 0, a == 1, a == 2);
    mapSample(q, v);
    result[a] = dot(slope, v);
  }
  return result;
}
`,dM=2;function pM(n){return n<=dM?n:null}function fM(n,t){const e=Xn.GRADE_SCALARS+Xn.GRADE_DENSITY;for(let i=0;i<t;i++)if(n[4*(i*Xn.EDIT_ROWS+e)+3]>.5)return!0;return!1}function mM(n,t){const{EDIT_ROWS:e,HEXAHEDRON:i,HEXAHEDRON_ROWS:s,AFFINE_SCALAR:r}=Xn,o=a=>n[4*a+3]??0;for(let a=0;a<t*e;a+=e){if(o(a+Xn.SIMPLE_SCALAR)>.5)continue;const l=[0,s].map(c=>o(a+i+c+r)>.5);if(o(a+Xn.FIRST_SCALAR)<.5&&!l[0]||o(a+Xn.LAST_SCALAR)>1.5&&!l[1])return!0}return!1}function gM(n){const t=s=>`if (place == 0 && inBox(p, rows[${s} + BOX_VECTOR].xyz, rows[${s} + BOX_VECTOR + 1].xyz)) place = mapEdit(${s}, p, v);`,i=["int mapSample(inout vec3 p, inout vec3 v) {","  int place = 0;",...(n===null?[`for (int n = editCount - 1; n >= 0; n--) { ${t("n * EDIT_ROWS")} }`]:Array.from({length:n},(s,r)=>t(`${n-1-r} * EDIT_ROWS`))).map(s=>`  ${s}`),"  return place;","}"];return uM.replace("MAP_SAMPLE",`${i.join(`
`)}
`)}const{MAX_ROWS:Fd,NODES_PER_TEXTURE_ROW:Go}=Xn;class vM{constructor(t){this.gl=t}uploaded={last:0,total:0};current=null;buffer=null;lattices=null;occupancy=null;get edits(){return this.current}get bricks(){return this.occupancy?.texture??null}countUpload(t){this.uploaded.last+=t,this.uploaded.total+=t}set(t){if(this.uploaded.last=0,t===null||t.edits===0){this.dispose();return}if(t.rows.length>4*Fd)throw new Error("more edits than the page's shader holds");this.putRows(t),this.putLattices(t),this.putOccupancy(t),this.current=t,this.uploaded.total+=this.uploaded.last}bind(t){const{gl:e}=this;return e.uniformBlockBinding(t,e.getUniformBlockIndex(t,"Edits"),0),e.bindBufferBase(e.UNIFORM_BUFFER,0,this.buffer),this.lattices?.texture??null}forget(){this.current=this.buffer=this.lattices=this.occupancy=null}dispose(){const{gl:t}=this;t.deleteBuffer(this.buffer),t.deleteTexture(this.lattices?.texture??null),t.deleteTexture(this.occupancy?.texture??null),this.forget()}putRows({rows:t}){const{gl:e}=this,i=this.buffer===null;this.buffer??=e.createBuffer(),e.bindBuffer(e.UNIFORM_BUFFER,this.buffer),i&&e.bufferData(e.UNIFORM_BUFFER,16*Fd,e.DYNAMIC_DRAW),e.bufferSubData(e.UNIFORM_BUFFER,0,t),e.bindBuffer(e.UNIFORM_BUFFER,null),this.uploaded.last+=t.byteLength}putLattices({lattices:t}){const{gl:e}=this,i=t.map(({halves:l})=>Math.ceil(l.length/(3*Go))),s=Math.max(1,i.reduce((l,c)=>l+c,0));if(s>wh(e,e.MAX_TEXTURE_SIZE))throw new Error("the edits' lattices do not fit into a texture of the GPU");(this.lattices===null||s>this.lattices.rows)&&(e.deleteTexture(this.lattices?.texture??null),this.lattices={texture:this.latticeTexture(s),rows:s,placed:[]});const{texture:r,placed:o}=this.lattices;mi(e),e.bindTexture(e.TEXTURE_2D,r);let a=0;this.lattices.placed=t.map(({key:l,halves:c},h)=>{const d={key:l,row:a};if(o.every(u=>u.key!==l||u.row!==d.row)){const u=3*Go*i[h],p=c.length===u?c:new Uint16Array(u);p!==c&&p.set(c),e.texSubImage2D(e.TEXTURE_2D,0,0,a,Go,i[h],e.RGB,e.HALF_FLOAT,p),this.uploaded.last+=p.byteLength}return a+=i[h],d}),e.bindTexture(e.TEXTURE_2D,null),Ia(e)}latticeTexture(t){const{gl:e}=this,i=e.createTexture();return e.bindTexture(e.TEXTURE_2D,i),e.texStorage2D(e.TEXTURE_2D,1,e.RGB16F,Go,t),Na(e,e.TEXTURE_2D,e.NEAREST),i}putOccupancy({occupancy:{key:t,dims:e,codes:i,changed:s}}){const{gl:r,occupancy:o}=this;if(o?.key===t)return;mi(r);const a=o!==null&&o.dims.every((p,g)=>p===e[g]);a||r.deleteTexture(o?.texture??null);const l=a?o.texture:ks(r,r.R16UI,[e[2],e[1],e[0]],r.NEAREST),c=a&&s?.of===o.key?s:{low:[0,0,0],dims:e,codes:i};r.bindTexture(r.TEXTURE_3D,l);const[h,d,u]=c.low;r.texSubImage3D(r.TEXTURE_3D,0,u,d,h,c.dims[2],c.dims[1],c.dims[0],r.RED_INTEGER,r.UNSIGNED_SHORT,c.codes),r.bindTexture(r.TEXTURE_3D,null),this.occupancy={texture:l,key:t,dims:e},this.uploaded.last+=c.codes.byteLength}}class Ua{constructor(t,e=()=>{}){this.onArrival=e,this.source=(t instanceof ArrayBuffer?new Blob([t]).stream():t).getReader()}chunks=[];buffered=0;arrived=0;source;async take(t){for(;this.buffered<t;){const{value:s,done:r}=await this.source.read();if(r)throw new Error("the file of the field is truncated");this.chunks.push(s),this.buffered+=s.length,this.arrived+=s.length,this.onArrival(this.arrived)}const e=new Uint8Array(t);let i=0;for(;i<t;){const s=this.chunks[0],r=s.subarray(0,t-i);e.set(r,i),i+=r.length,r.length===s.length?this.chunks.shift():this.chunks[0]=s.subarray(r.length)}return this.buffered-=t,e}cancel(){this.source.cancel().catch(()=>{})}}async function _M(n){const t=new Blob([n]).stream().pipeThrough(new DecompressionStream("deflate"));return await new Response(t).arrayBuffer()}class Js{constructor(t,e,i){this.header=t,this.entries=e,this.reader=i}next=0;static async open(t,e,i){const s=await t.take(16),r=new DataView(s.buffer);if(String.fromCharCode(...s.subarray(0,8))!==e)throw new Error(`not a file of the kind "${e}"`);const o=r.getUint32(8,!0);if(o!==i)throw new Error(`"${e}" of version ${o}, this page reads ${i}; reload it`);const a=new TextDecoder().decode(await t.take(r.getUint32(12,!0))),l=JSON.parse(a);return new Js(l,l.arrays,t)}get left(){return this.entries.slice(this.next).reduce((t,e)=>t+e.bytes,0)}async read(t){const e=this.entries.at(this.next);if(e?.name!==t)throw new Error(`the file of the field has no array "${t}" here`);this.next++;const i=await _M(await this.reader.take(e.bytes));switch(e.type){case"u1":return new Uint8Array(i);case"u2":return new Uint16Array(i);case"i4":return new Int32Array(i);case"f4":return new Float32Array(i)}}}const xM="cagepage",bM=1;async function*wM(n,t){const e=new Ua(n,t);try{const i=await Js.open(e,xM,bM);for(const[s,r]of i.header.levels.entries()){const o=await i.read(`${s}.bricks`),a=await i.read(`${s}.masks`),l=await i.read(`${s}.occupancy`),c=await Sm(i,`${s}`);yield{field:i.header,header:r,last:s===i.header.levels.length-1,bricks:o,masks:a,...c,occupancy:{origin:[0,0,0],dims:r.dims,codes:l}}}}finally{e.cancel()}}async function Sm(n,t){const e=Em(await n.read(`${t}.density`));return{density:e,sh:yM(await n.read(`${t}.sh`),e.length)}}function Em(n){const t=n.length/2,e=new Uint16Array(t);for(let i=0;i<t;i++)e[i]=n[i]|n[t+i]<<8;return e}function yM(n,t){if(t===0)return n;for(let e=0;e<n.length;e+=t){let i=128;for(let s=e;s<e+t;s++)n[s]=i=i+n[s]&255}return n}const Dc=["0.28209479177387814","-0.4886025119029199 * d.y","0.4886025119029199 * d.z","-0.4886025119029199 * d.x","1.0925484305920792 * d.x * d.y","-1.0925484305920792 * d.y * d.z","0.31539156525252005 * (2.0 * d.z * d.z - d.x * d.x - d.y * d.y)","-1.0925484305920792 * d.x * d.z","0.5462742152960396 * (d.x * d.x - d.y * d.y)","-0.5900435899266435 * d.y * (3.0 * d.x * d.x - d.y * d.y)","2.890611442640554 * d.x * d.y * d.z","-0.4570457994644658 * d.y * (4.0 * d.z * d.z - d.x * d.x - d.y * d.y)","0.3731763325901154 * d.z * (2.0 * d.z * d.z - 3.0 * d.x * d.x - 3.0 * d.y * d.y)","-0.4570457994644658 * d.x * (4.0 * d.z * d.z - d.x * d.x - d.y * d.y)","1.445305721320277 * d.z * (d.x * d.x - d.y * d.y)","-0.5900435899266435 * d.x * (d.x * d.x - 3.0 * d.y * d.y)","2.5033429417967046 * d.x * d.y * (d.x * d.x - d.y * d.y)","-1.7701307697799304 * d.y * d.z * (3.0 * d.x * d.x - d.y * d.y)","0.9461746957575601 * d.x * d.y * (6.0 * d.z * d.z - d.x * d.x - d.y * d.y)","-0.6690465435572892 * d.y * d.z * (4.0 * d.z * d.z - 3.0 * (d.x * d.x + d.y * d.y))","0.10578554691520431 * (8.0 * d.z * d.z * d.z * d.z - 24.0 * d.z * d.z * (d.x * d.x + d.y * d.y) + 3.0 * (d.x * d.x + d.y * d.y) * (d.x * d.x + d.y * d.y))","-0.6690465435572892 * d.x * d.z * (4.0 * d.z * d.z - 3.0 * (d.x * d.x + d.y * d.y))","0.47308734787878004 * (d.x * d.x - d.y * d.y) * (6.0 * d.z * d.z - d.x * d.x - d.y * d.y)","-1.7701307697799304 * d.x * d.z * (d.x * d.x - 3.0 * d.y * d.y)","0.6258357354491761 * (d.x * d.x * (d.x * d.x - 3.0 * d.y * d.y) - d.y * d.y * (3.0 * d.x * d.x - d.y * d.y))"];function SM(n){const t=Math.ceil(3*n/4),e=[`uniform float coefficientSteps[${n}];`,...Array.from({length:t},(i,s)=>`uniform sampler3D colorAtlas${s};`),"vec3 colorAt(vec3 at, vec3 d) {","  vec3 rgb = vec3(0.5);",...Array.from({length:t},(i,s)=>`  vec4 s${s} = 255.0 * textureLod(colorAtlas${s}, at, 0.0) - 128.0;`)];for(let i=0;i<n;i++){const s=[0,1,2].map(r=>`s${3*i+r>>2}.${"xyzw"[3*i+r&3]}`);e.push(`  rgb += (coefficientSteps[${i}] * (${Dc[i]})) * vec3(${s.join(", ")});`)}return{source:[...e,"  return rgb;","}"].join(`
`),colors:t}}const EM=`
uniform sampler3D densityAtlas;
uniform usampler3D brickIndex;
uniform usampler3D bricks;
uniform vec3 atlasScale;
uniform ivec3 indexDims;
uniform ivec3 bricksOrigin;
uniform ivec3 bricksDims;
uniform ivec3 resolution;
uniform vec3 lower;
uniform vec3 scale;
uniform vec3 halfGrid;
uniform float unit;
uniform float marchStep;
uniform float near;
uniform vec3 background;
uniform vec3 eye;
uniform mat3 rotation;
uniform vec4 lens;
uniform float height;
uniform bool layered;
layout(location = 0) out vec4 outColor;
layout(location = 1) out uint outDepth;
#ifdef NORMALS
layout(location = 2) out vec4 outNormal;
#endif

vec3 contract(vec3 q) {
  float m = max(max(max(abs(q.x), abs(q.y)), abs(q.z)), 1.0);
  return ((2.0 - 1.0 / m) / m) * q;
}

vec3 contractVelocity(vec3 q, vec3 d) {
  vec3 a = abs(q);
  float m = max(max(a.x, a.y), a.z);
  if (m <= 1.0) return d;
  float dm = d.x * sign(q.x);
  if (a.y >= m) dm = d.y * sign(q.y);
  if (a.z >= m) dm = d.z * sign(q.z);
  return ((2.0 - 1.0 / m) / m) * d + ((-2.0 + 2.0 / m) / (m * m)) * dm * q;
}

vec2 slab(vec3 origin, vec3 inverse_, vec3 low, vec3 high) {
  vec3 a = (low - origin) * inverse_;
  vec3 b = (high - origin) * inverse_;
  vec3 first = min(a, b);
  vec3 last = max(a, b);
  return vec2(max(max(first.x, first.y), first.z), min(min(last.x, last.y), last.z));
}

vec3 safeInverse(vec3 d) { return 1.0 / mix(d, vec3(1e-12), lessThan(abs(d), vec3(1e-12))); }

float emptyRun(vec3 g, vec3 inverse_) {
  ivec3 cell = ivec3(floor(g)) - bricksOrigin;
  ivec3 b = clamp(cell >> 2, ivec3(0), bricksDims - 1);
  int code = int(texelFetch(bricks, b.zyx, 0).r);
  ivec3 low;
  int size;
  if (code >= 256) {
    int d = code >> 8;
    low = (b - (d - 1)) * 4;
    size = (2 * d - 1) * 4;
  } else {
    ivec3 s = (cell >> 1) & 1;
    if (((code >> (s.x * 4 + s.y * 2 + s.z)) & 1) == 1) return -1.0;
    low = (cell >> 1) << 1;
    size = 2;
  }
  vec3 lo = vec3(low + bricksOrigin);
  vec3 last = max((lo - g) * inverse_, (lo + float(size) - g) * inverse_);
  return max(min(min(last.x, last.y), last.z), 0.0);
}

vec3 toGrid(vec3 p) {
  vec3 g = (p - lower) * scale;
#ifdef CONTRACTED
  g = (contract(g) + 2.0) * halfGrid;
#endif
  return g;
}

// Texel coordinates in the atlas, whole numbers at vertices, of grid coordinates in the field, or in the layer at an
// offset; false for an empty brick.
bool locate(vec3 g, int place, out vec3 texel, out ivec3 corner) {
  vec3 inside = clamp(g, vec3(0.0), vec3(resolution - 1));
  ivec3 b = min(ivec3(inside) / BRICK, indexDims - 1);
  uvec4 entry = texelFetch(brickIndex, ivec3(b.zy, b.x + place / BRICK), 0);
  corner = ivec3(entry.xyz) * (BRICK + 1);
  texel = vec3(corner) + (inside - vec3(b * BRICK)).zyx;
  return entry.a > 0u;
}

// Gradient of the interpolated density in grid coordinates.
vec3 densitySlope(vec3 texel, ivec3 corner) {
  ivec3 cell = corner + min(ivec3(texel) - corner, ivec3(BRICK - 1));
  vec3 f = texel - vec3(cell);
  vec3 e = 1.0 - f;
  float r000 = texelFetch(densityAtlas, cell, 0).r;
  float r100 = texelFetch(densityAtlas, cell + ivec3(1, 0, 0), 0).r;
  float r010 = texelFetch(densityAtlas, cell + ivec3(0, 1, 0), 0).r;
  float r110 = texelFetch(densityAtlas, cell + ivec3(1, 1, 0), 0).r;
  float r001 = texelFetch(densityAtlas, cell + ivec3(0, 0, 1), 0).r;
  float r101 = texelFetch(densityAtlas, cell + ivec3(1, 0, 1), 0).r;
  float r011 = texelFetch(densityAtlas, cell + ivec3(0, 1, 1), 0).r;
  float r111 = texelFetch(densityAtlas, cell + ivec3(1, 1, 1), 0).r;
  return vec3(
    (r001 - r000) * e.x * e.y + (r101 - r100) * f.x * e.y + (r011 - r010) * e.x * f.y + (r111 - r110) * f.x * f.y,
    (r010 - r000) * e.x * e.z + (r110 - r100) * f.x * e.z + (r011 - r001) * e.x * f.z + (r111 - r101) * f.x * f.z,
    (r100 - r000) * e.y * e.z + (r110 - r010) * f.y * e.z + (r101 - r001) * e.y * f.z + (r111 - r011) * f.y * f.z
  ) * unit;
}

vec3 pullBack(vec3 slope, vec3 q) {
  return vec3(
    dot(slope, contractVelocity(q, vec3(1.0, 0.0, 0.0))),
    dot(slope, contractVelocity(q, vec3(0.0, 1.0, 0.0))),
    dot(slope, contractVelocity(q, vec3(0.0, 0.0, 1.0)))
  );
}
`,MM=`
// Rounded here, and centered in the step of 8 bits: some GPUs truncate and others round.
vec4 eightBits(vec4 v) { return (floor(255.0 * clamp(v, 0.0, 1.0) + 0.5) + 0.25) / 255.0; }

void main() {
  vec2 pixel = vec2(gl_FragCoord.x, height - gl_FragCoord.y);
  vec3 d = rotation * normalize(vec3((pixel - lens.zw) / lens.xy * vec2(1.0, -1.0), -1.0));
  vec3 go = (eye - lower) * scale;
  vec3 gd = d * scale;
  vec3 inverse_ = safeInverse(gd);
  float t = near;
  float end = 1e30;
#ifndef CONTRACTED
  vec3 lo = vec3(bricksOrigin);
  vec2 hit = slab(go, inverse_, lo, lo + 4.0 * vec3(bricksDims));
  t = max(hit.x, near) + 0.5 * marchStep;
  end = hit.y;
#endif
#ifdef EDITED
  vec2 edited = editedPart(eye, d);
#endif
  float T = 1.0;
  vec3 rgb = vec3(0.0);
  vec3 normal = vec3(0.0);
  float depth = 0.0;
#ifdef COUNT
  int samples = 0;
  int reads = 0;
#endif
  while (t < end && T > 1e-3) {
    vec3 g = go + t * gd;
    float h = marchStep;
    float leap = 0.0;
#ifdef CONTRACTED
    vec3 q = g;
    vec3 v = contractVelocity(q, gd) * halfGrid;
    g = (contract(q) + 2.0) * halfGrid;
    h = marchStep / max(max(abs(v.x), abs(v.y)), abs(v.z));
    float m = max(max(abs(q.x), abs(q.y)), abs(q.z));
    if (m > 2.0 * halfGrid.x) end = t;
    float run = emptyRun(g, safeInverse(v));
    if (run >= 0.0) {
      leap = m > 1.0 ? min(0.5 * run, 0.25 * m / max(max(abs(gd.x), abs(gd.y)), abs(gd.z))) : run + 0.5 * h;
      leap = max(leap, h);
    }
#else
    float run = emptyRun(g, inverse_);
    if (run >= 0.0) leap = (floor(run / marchStep) + 1.0) * marchStep;
#endif
#ifdef COUNT
    reads += 1;
#endif
    if (run >= 0.0) {
      t += leap;
      continue;
    }
    bool alive = true;
    bool moved = false;
    int place = 0;
    vec3 view = d;
#ifdef EDITED
    if (t >= edited.x && t <= edited.y) {
      vec3 p = eye + t * d;
      vec3 canonical = p;
      place = mapSample(canonical, view);
      vec3 by = abs(canonical - p);
      moved = max(max(by.x, by.y), by.z) > 0.0;
      if (place < 0) alive = false;
      else if (!layered) place = 0;
      if (moved) g = toGrid(canonical);
    }
#endif
    vec3 texel;
    ivec3 corner;
    alive = alive && all(greaterThanEqual(g, vec3(-1e-3))) && all(lessThanEqual(g, vec3(resolution - 1) + 1e-3));
    if (alive && locate(g, place, texel, corner)) {
      vec3 at = (texel + 0.5) * atlasScale;
      float raw = textureLod(densityAtlas, at, 0.0).r * unit;
#ifdef COUNT
      samples += 1;
      reads += 2;
#endif
      if (raw > 0.0) {
#ifdef EDITED
        if (moved && preserveOpacity) raw *= length(view);
#endif
#ifdef GRADED
        mat3 grade = mat3(1.0);
        if (t >= edited.x && t <= edited.y) {
          float thickness;
          grade = gradeSample(eye + t * d, thickness);
          raw *= thickness;
        }
#endif
        float keep = exp(-raw * h);
        float w = T * (1.0 - keep);
        T *= keep;
        if (w > 1e-4) {
          vec3 c = colorAt(at, view / max(length(view), 1e-20));
#ifdef COUNT
          reads += COLORS;
#endif
          c = clamp(c, 0.0, 1.0);
#ifdef GRADED
          c = clamp(grade * c, 0.0, 1.0);
#endif
          rgb += w * c;
          depth += w * t;
#ifdef NORMALS
          vec3 slope = densitySlope(texel, corner);
#ifdef CONTRACTED
          slope = pullBack(slope * halfGrid, MOVED_POINT) * scale;
#else
          slope *= scale;
#endif
#ifdef EDITED
          if (moved) slope = throughEdits(slope, eye + t * d);
#endif
          normal -= w * slope / max(length(slope), 1e-12);
#endif
        }
      }
    }
    t += h;
  }
  float opacity = 1.0 - T;
  outColor = eightBits(vec4(rgb + T * background, opacity));
#ifdef COUNT
  outDepth = uint(reads / 4) << 16 | uint(samples);
#else
  outDepth = floatBitsToUint(opacity > 1e-6 ? depth / opacity : intBitsToFloat(0x7f800000));
#endif
#ifdef NORMALS
  float size = length(normal);
  outNormal = eightBits(vec4(size > 1e-6 ? 0.5 + 0.5 * normal / size : vec3(0.5), opacity));
#endif
}
`;function TM(n,t){const{source:e,colors:i}=SM(n.K),s=[`#define BRICK ${t}`,`#define COLORS ${i}`,"#define MOVED_POINT ((eye + t * d - lower) * scale)"];return n.contracted&&s.push("#define CONTRACTED"),n.edited&&s.push("#define EDITED"),n.edited&&n.graded&&s.push("#define GRADED"),n.edited&&n.bent&&s.push("#define BENT"),n.normals&&s.push("#define NORMALS"),n.count&&s.push("#define COUNT"),["#version 300 es","precision highp float;","precision highp int;","precision highp sampler2D;","precision highp sampler3D;","precision highp usampler3D;",...s,EM,e,n.edited?gM(n.edits):"",MM].join(`
`)}function AM(n,t,e,i,s,r){const{bounds:o,contracted:a}=e.field,{resolution:l,unit:c,steps:h}=e.header,{atlasBricks:d,edge:u,dims:p}=i,x=o[1].map((f,_)=>f-o[0][_]).map((f,_)=>a?2/f:(l[_]-1)/f),m=o[0].map((f,_)=>a?.5*(f+o[1][_]):f);n.uniform3f(t("atlasScale"),1/(d[0]*u),1/(d[1]*u),1/(d[2]*u)),n.uniform3i(t("indexDims"),...p),n.uniform3i(t("bricksOrigin"),...s.origin),n.uniform3i(t("bricksDims"),...s.dims),n.uniform3i(t("resolution"),...l),n.uniform3fv(t("lower"),m),n.uniform3fv(t("scale"),x),n.uniform3fv(t("halfGrid"),l.map(f=>(f-1)/4)),n.uniform1f(t("unit"),c),n.uniform1f(t("marchStep"),a?r:r/Math.max(...x)),n.uniform1fv(t("coefficientSteps"),h)}function CM(n,t,e,{width:i,height:s}){const{c2w:r}=e,o=i/e.width,a=s/e.height;n.uniform3f(t("eye"),r[3],r[7],r[11]),n.uniformMatrix3fv(t("rotation"),!0,[r[0],r[1],r[2],r[4],r[5],r[6],r[8],r[9],r[10]]),n.uniform4f(t("lens"),e.fx*o,e.fy*a,e.cx*o,e.cy*a),n.uniform1f(t("height"),s)}function Mm([n,t],e){const i=.5*Math.hypot(...t.map((r,o)=>r-n[o])),s=Math.hypot(...t.map((r,o)=>.5*(r+n[o])-e.c2w[4*o+3]));return[Math.max(0,s-i),s+i]}const Tm=1,RM=2;async function PM(n,t,e){const i=[...await n.read(`${t}.box`)],s=await n.read(`${t}.cells`),r=await n.read(`${t}.bricks`),o=await n.read(`${t}.masks`);return{key:e,low:i.slice(0,3),dims:i.slice(3),cells:s,bricks:r,masks:o,...await Sm(n,t)}}function Am(n,{dims:t}){return Int32Array.from(Ic(n,t,Tm))}function LM(n,t,e){const{dims:i,atlasBricks:s}=n,r=4*i[1]*i[2],o=Math.max(i[0],...t.map(l=>l.place+l.end)),a=new Uint8Array(o*r);a.set(n.index);for(const{layer:l,place:c,...h}of t){const d=c*r,[u,p]=[Math.max(0,h.first),Math.min(h.end,i[0])].map(m=>m*r);a.set(n.index.subarray(u,p),d+u);const g=e(l);let x=0;for(const m of Ic(l,i,Tm))a.set(_h(g[x++],s),d+4*m);for(const m of Ic(l,i,RM))a.fill(0,d+4*m,d+4*m+4)}return{dims:[o,i[1],i[2]],index:a}}function*Ic({low:n,dims:t,cells:e},i,s){let r=0;for(let o=n[0];o<n[0]+t[0];o++)for(let a=n[1];a<n[1]+t[1];a++)for(let l=n[2];l<n[2]+t[2];l++,r++)e[r]===s&&(yield(o*i[1]+a)*i[2]+l)}async function DM(n,t=null){const e=await Js.open(new Ua(n),"cageedit",3),{header:i}=e,s=await e.read("rows"),r=[];for(const[p,{key:g}]of i.lattices.entries()){const x=[...r,...t?.lattices??[]].find(m=>m.key===g);r.push(x??{key:g,halves:Em(await e.read(`lattice.${p}`))})}const o=[];for(const[p,{key:g,...x}]of i.layers.entries()){const m=[...o,...t?.layers??[]].find(({layer:f})=>f.key===g);o.push({layer:m?.layer??await PM(e,`layer.${p}`,g),...x})}const{key:a,origin:l,dims:c,part:h}=i.occupancy,d=t?.occupancy??null;let u;if(d?.key===a)u=d;else{const p=await e.read("occupancy");if(h===null)u={key:a,origin:l,dims:c,codes:p,changed:null};else if(d?.key===h.of)u={key:a,origin:l,dims:c,codes:IM(d,h.low,h.dims,p),changed:{...h,codes:p}};else throw new Error("the edits are a difference to edits that this page does not have; reload it")}return{edits:i.edits,boxes:i.boxes,preserveOpacity:i.preserve_opacity,rows:s,lattices:r,layers:o,occupancy:u}}function IM({dims:n,codes:t},e,i,s){const r=t.slice();let o=0;for(let a=e[0];a<e[0]+i[0];a++)for(let l=e[1];l<e[1]+i[1];l++,o+=i[2])r.set(s.subarray(o,o+i[2]),(a*n[1]+l)*n[2]+e[2]);return r}const kr=`#version 300 es
void main() { gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0); }`;function Bs(n){for(const t of[n.BLEND,n.DEPTH_TEST,n.CULL_FACE,n.STENCIL_TEST,n.SCISSOR_TEST,n.DITHER])n.disable(t);n.colorMask(!0,!0,!0,!0),n.depthMask(!1)}function zs(n){for(let t=15;t>=0;t--)n.activeTexture(n.TEXTURE0+t),n.bindTexture(n.TEXTURE_2D,null),n.bindTexture(n.TEXTURE_3D,null);n.bindVertexArray(null),n.bindFramebuffer(n.FRAMEBUFFER,null),n.useProgram(null)}const NM=1/4,UM=64;function OM(n,t,e,i){const s=wh(n,n.MAX_3D_TEXTURE_SIZE),r=i(wl(t,s)),o=wl(t,s,r),a=Lc(o);if(a>e)throw new rs(`the field takes ${Math.ceil(a/2**20)} MiB of the GPU, more than the ${Math.floor(e/2**20)} allowed`);if(!t.last)return o;try{const l=wl(t,s,r+Math.max(UM,Math.ceil(NM*(o.count+r))));return Lc(l)>e?o:l}catch(l){if(l instanceof rs)return o;throw l}}async function FM(n,t,e,i){const s=Cm(n,t,e);try{for(let r=s.next();;r=i()?s.next():s.throw(new Error("not wanted any more"))){if(r.done)return r.value;await new Promise(o=>setTimeout(o))}}catch(r){if(!i())return null;throw r}}function kM(n,t,e){const i=Cm(n,t,e);for(;;){const s=i.next();if(s.done)return s.value}}function*Cm(n,t,e){const{atlasBricks:i,edge:s,dims:r}=e,o=i.map(c=>c*s),a=[];let l=!1;try{const c=ks(n,n.R16F,o,n.LINEAR);a.push(c);const h=Array.from({length:e.colorTextures},()=>{const g=ks(n,n.RGBA8,o,n.LINEAR);return a.push(g),g}),d=new wm(e,[Fr.fromLevel(t)]),u=i[0]*i[1];for(let g=0;g<i[2];g++){mi(n);const x=e.bricks.subarray(g*u,(g+1)*u);Rm(n,{layout:e,density:c,colors:h},d.texels(x,i[0],i[1]),[0,0,g],[i[0],i[1]]),yield}mi(n);const p=ks(n,n.RGBA8UI,[r[2],r[1],r[0]],n.NEAREST);return a.push(p),n.texSubImage3D(n.TEXTURE_3D,0,0,0,0,r[2],r[1],r[0],n.RGBA_INTEGER,n.UNSIGNED_BYTE,e.index),n.bindTexture(n.TEXTURE_3D,null),Ia(n),l=!0,{layout:e,density:c,colors:h,index:p,slices:r[0],bytes:Lc(e)}}finally{if(!l)for(const c of a)n.deleteTexture(c)}}function Rm(n,{layout:{edge:t},density:e,colors:i},s,r,o){const a=(l,c,h,d)=>{n.bindTexture(n.TEXTURE_3D,l);const[u,p,g]=r.map(x=>x*t);n.texSubImage3D(n.TEXTURE_3D,0,u,p,g,o[0]*t,o[1]*t,t,c,h,d)};a(e,n.RED,n.HALF_FLOAT,s.density),s.colors.forEach((l,c)=>a(i[c],n.RGBA,n.UNSIGNED_BYTE,l)),n.bindTexture(n.TEXTURE_3D,null)}function kd(n,{dims:t,codes:e}){mi(n);const i=ks(n,n.R16UI,[t[2],t[1],t[0]],n.NEAREST);return n.texSubImage3D(n.TEXTURE_3D,0,0,0,0,t[2],t[1],t[0],n.RED_INTEGER,n.UNSIGNED_SHORT,e),n.bindTexture(n.TEXTURE_3D,null),i}function Bd(n,t){for(const e of[t.density,t.index,...t.colors])n.deleteTexture(e)}class BM{free;allocated=new Map;constructor(t,e){this.free=Array.from({length:Math.max(0,e-t)},(i,s)=>e-1-s)}get left(){return this.free.length}get(t){return this.allocated.get(t)??null}retain(t){for(const[e,i]of this.allocated)t.has(e)||(this.free.push(...Array.from(i).reverse()),this.allocated.delete(e))}allocate(t,e){if(e>this.free.length)return null;const i=Int32Array.from({length:e},()=>this.free.pop()??-1);return this.allocated.set(t,i),i}}function zM(n,t){return[...new Map(n.map(({layer:i})=>[i.key,i])).values()].reduce((i,s)=>i+Am(s,t).length,0)}class zd{constructor(t,e,i){this.gl=t,this.textures=e,this.level=i;const{atlasBricks:s,count:r}=e.layout;this.allocator=new BM(r,s[0]*s[1]*s[2])}allocator;fieldVertices=null;shownKey="[]";set(t){const e=JSON.stringify(t.map(({layer:s,place:r,first:o,end:a})=>[s.key,r,o,a]));if(e===this.shownKey)return 0;this.allocator.retain(new Set(t.map(({layer:s})=>s.key)));let i=0;for(const{layer:s}of t){if(this.allocator.get(s.key))continue;const r=Am(s,this.textures.layout),o=this.allocator.allocate(s.key,r.length);if(o===null)return this.shownKey="",null;i+=this.upload(s,r,o)}return i+=this.putIndex(t),this.shownKey=e,Ia(this.gl),i}upload(t,e,i){const{gl:s,textures:r,level:o}=this,{layout:a}=r;this.fieldVertices??=Fr.fromLevel(o);const l=new wm(a,[new Fr(t,a.brick,t.low,t.dims),this.fieldVertices]);return mi(s),e.forEach((c,h)=>{const[d,u,p]=_h(i[h],a.atlasBricks);Rm(s,r,l.texels([c],1,1),[d,u,p],[1,1])}),e.length*a.edge**3*(2+4*a.colorTextures)}putIndex(t){const{gl:e,textures:i}=this,{dims:s,index:r}=LM(i.layout,t,o=>this.allocator.get(o.key)??[]);return mi(e),s[0]!==i.slices&&(e.deleteTexture(i.index),i.index=ks(e,e.RGBA8UI,[s[2],s[1],s[0]],e.NEAREST),i.slices=s[0]),e.bindTexture(e.TEXTURE_3D,i.index),e.texSubImage3D(e.TEXTURE_3D,0,0,0,0,s[2],s[1],s[0],e.RGBA_INTEGER,e.UNSIGNED_BYTE,r),e.bindTexture(e.TEXTURE_3D,null),r.length}}class yh{constructor(t,e,i,s){this.gl=t,this.memory=e,this.level=i,this.textures=s,this.layers=i.last?new zd(t,s,i):null,this.occupancy=kd(t,i.occupancy)}occupancy;layers;solidOccupancy=null;static async upload(t,e,i,s,r){const o=await FM(t,i,Vd(t,e,i,s),r);return o&&new yh(t,e,i,o)}get layered(){return this.layers!==null}putLayers(t){if(this.layers===null)return 0;const e=this.layers.set(t);if(e!==null)return e;const{gl:i,level:s}=this,r=Vd(i,this.memory,s,t);return Bd(i,this.textures),this.textures=kM(i,s,r),this.layers=new zd(i,this.textures,s),this.layers.set(t)??0}get fullOccupancy(){const{occupancy:t}=this.level;return this.solidOccupancy??=kd(this.gl,{...t,codes:new Uint16Array(t.codes.length).fill(255)}),this.solidOccupancy}dispose(){Bd(this.gl,this.textures),this.gl.deleteTexture(this.occupancy),this.gl.deleteTexture(this.solidOccupancy)}}function Vd(n,t,e,i){return OM(n,e,t,s=>e.last?zM(i,s):0)}class Pm{constructor(t){this.gl=t}width=1;height=1;textures=null;framebuffer=null;get color(){return this.textures?.color??null}get normals(){return this.textures?.normals??null}get depth(){return this.textures?.depth??null}setSize(t,e){t===this.width&&e===this.height||(this.dispose(),this.width=t,this.height=e)}bind(t){const{gl:e}=this;if(this.textures&&t&&!this.textures.normals&&this.dispose(),!this.textures){this.textures={color:this.texture(e.RGBA8,e.LINEAR),depth:this.texture(e.R32UI,e.NEAREST),normals:t?this.texture(e.RGBA8,e.NEAREST):null},this.framebuffer=e.createFramebuffer(),e.bindFramebuffer(e.FRAMEBUFFER,this.framebuffer);const{color:i,depth:s,normals:r}=this.textures;for(const[o,a]of[i,s,r].entries())a&&e.framebufferTexture2D(e.FRAMEBUFFER,e.COLOR_ATTACHMENT0+o,e.TEXTURE_2D,a,0)}e.bindFramebuffer(e.FRAMEBUFFER,this.framebuffer),e.drawBuffers([e.COLOR_ATTACHMENT0,e.COLOR_ATTACHMENT1,...t?[e.COLOR_ATTACHMENT2]:[]]),e.viewport(0,0,this.width,this.height)}read(t){const{gl:e,width:i,height:s}=this,r=new Uint8Array(4*i*s),o=t&&this.textures?.normals?new Uint8Array(4*i*s):null;e.bindFramebuffer(e.FRAMEBUFFER,this.framebuffer),e.bindBuffer(e.PIXEL_PACK_BUFFER,null),e.pixelStorei(e.PACK_ALIGNMENT,1),e.readBuffer(e.COLOR_ATTACHMENT0),e.readPixels(0,0,i,s,e.RGBA,e.UNSIGNED_BYTE,r),o&&(e.readBuffer(e.COLOR_ATTACHMENT2),e.readPixels(0,0,i,s,e.RGBA,e.UNSIGNED_BYTE,o)),e.bindFramebuffer(e.FRAMEBUFFER,null);const a=yl(this.readDepth(),i);return{width:i,height:s,rgba:yl(r,4*i),depth:a,normals:o&&yl(o,4*i)}}readBits(t,e){const{gl:i}=this,s=new Uint32Array(t*e);if(i.bindBuffer(i.PIXEL_PACK_BUFFER,null),i.pixelStorei(i.PACK_ALIGNMENT,1),i.getParameter(i.IMPLEMENTATION_COLOR_READ_FORMAT)===i.RED_INTEGER)i.readPixels(0,0,t,e,i.RED_INTEGER,i.UNSIGNED_INT,s);else{const r=new Uint32Array(4*t*e);i.readPixels(0,0,t,e,i.RGBA_INTEGER,i.UNSIGNED_INT,r);for(let o=0;o<s.length;o++)s[o]=r[4*o]}return new Float32Array(s.buffer)}wait(){const{gl:t}=this;t.bindFramebuffer(t.FRAMEBUFFER,this.framebuffer),t.bindBuffer(t.PIXEL_PACK_BUFFER,null),t.readBuffer(t.COLOR_ATTACHMENT0),t.readPixels(0,0,1,1,t.RGBA,t.UNSIGNED_BYTE,new Uint8Array(4)),t.bindFramebuffer(t.FRAMEBUFFER,null)}forget(){this.textures=this.framebuffer=null}dispose(){const{gl:t,textures:e}=this;if(e)for(const i of Object.values(e))t.deleteTexture(i);t.deleteFramebuffer(this.framebuffer),this.forget()}readDepth(){const{gl:t}=this;t.bindFramebuffer(t.FRAMEBUFFER,this.framebuffer),t.readBuffer(t.COLOR_ATTACHMENT1);const e=this.readBits(this.width,this.height);return t.bindFramebuffer(t.FRAMEBUFFER,null),e}texture(t,e){const{gl:i}=this,s=i.createTexture();return i.bindTexture(i.TEXTURE_2D,s),i.texStorage2D(i.TEXTURE_2D,1,t,this.width,this.height),i.texParameteri(i.TEXTURE_2D,i.TEXTURE_MIN_FILTER,e),i.texParameteri(i.TEXTURE_2D,i.TEXTURE_MAG_FILTER,e),i.bindTexture(i.TEXTURE_2D,null),s}}function yl(n,t){const e=n.length/t;for(let i=0;i<e>>1;i++){const[s,r]=[i*t,(e-1-i)*t],o=n.slice(s,s+t);n.copyWithin(s,r,r+t),n.set(o,r)}return n}const ia=["color","depth","opacity","normals"],VM=`#version 300 es
precision highp float;
precision highp usampler2D;
uniform sampler2D picture;
uniform usampler2D depthBits;
uniform sampler2D normals;
uniform vec2 size;
uniform vec2 reach;
uniform int view;
out vec4 color;
void main() {
  vec2 at = gl_FragCoord.xy / size;
  vec4 c = texture(picture, at);
  if (view == ${ia.indexOf("depth")}) {
    float far = uintBitsToFloat(texelFetch(depthBits, ivec2(at * vec2(textureSize(depthBits, 0))), 0).r);
    float share = (min(far, reach.y) - reach.x) / max(reach.y - reach.x, 1e-9);
    c.rgb = vec3((1.0 - 0.85 * clamp(share, 0.0, 1.0)) * c.a);
  } else if (view == ${ia.indexOf("opacity")}) {
    c.rgb = vec3(c.a);
  } else if (view == ${ia.indexOf("normals")}) {
    c.rgb = texture(normals, at).rgb * c.a;
  }
  color = vec4(c.rgb, 1.0);
}`,HM=`#version 300 es
precision highp float;
precision highp usampler2D;
uniform sampler2D picture;
uniform usampler2D depthBits;
uniform int stride;
uniform int height;
out uint bits;
void main() {
  ivec2 at = ivec2(gl_FragCoord.xy) * stride;
  at.y = height - 1 - at.y;
  bits = texelFetch(picture, at, 0).a > 0.5 ? texelFetch(depthBits, at, 0).r : 0x7f800000u;
}`;class Lm{constructor(t,e){this.gl=t,this.targets=e}programs=null;distanceTarget=null;show(t,e,i,s){const{gl:r}=this,{program:o,uniform:a}=this.compiledPrograms.show;r.viewport(0,0,i,s),r.useProgram(o),this.bind(a),r.activeTexture(r.TEXTURE2),r.bindTexture(r.TEXTURE_2D,this.targets.normals),r.uniform1i(a("normals"),2),r.uniform2f(a("size"),i,s),r.uniform2f(a("reach"),...e),r.uniform1i(a("view"),ia.indexOf(t)),r.drawArrays(r.TRIANGLES,0,3)}distances(t){const{gl:e,targets:i}=this,s=Math.max(1,Math.ceil(Math.sqrt(i.width*i.height/t))),[r,o]=[Math.ceil(i.width/s),Math.ceil(i.height/s)];this.bindDistanceTarget(r,o);const{program:a,uniform:l}=this.compiledPrograms.distances;return e.viewport(0,0,r,o),e.useProgram(a),this.bind(l),e.uniform1i(l("stride"),s),e.uniform1i(l("height"),i.height),e.drawArrays(e.TRIANGLES,0,3),e.readBuffer(e.COLOR_ATTACHMENT0),{width:r,height:o,values:i.readBits(r,o)}}forget(){this.programs=this.distanceTarget=null}dispose(){const{gl:t}=this;for(const{program:e}of Object.values(this.programs??{}))t.deleteProgram(e);t.deleteTexture(this.distanceTarget?.texture??null),t.deleteFramebuffer(this.distanceTarget?.framebuffer??null),this.forget()}get compiledPrograms(){return this.programs??={show:Fs(this.gl,kr,VM),distances:Fs(this.gl,kr,HM)},this.programs}bind(t){const{gl:e,targets:i}=this;e.activeTexture(e.TEXTURE0),e.bindTexture(e.TEXTURE_2D,i.color),e.uniform1i(t("picture"),0),e.activeTexture(e.TEXTURE1),e.bindTexture(e.TEXTURE_2D,i.depth),e.uniform1i(t("depthBits"),1)}bindDistanceTarget(t,e){const{gl:i}=this;if(this.distanceTarget?.width!==t||this.distanceTarget.height!==e){i.deleteTexture(this.distanceTarget?.texture??null),i.deleteFramebuffer(this.distanceTarget?.framebuffer??null);const s=i.createTexture();i.bindTexture(i.TEXTURE_2D,s),i.texStorage2D(i.TEXTURE_2D,1,i.R32UI,t,e);const r=i.createFramebuffer();i.bindFramebuffer(i.FRAMEBUFFER,r),i.framebufferTexture2D(i.FRAMEBUFFER,i.COLOR_ATTACHMENT0,i.TEXTURE_2D,s,0),this.distanceTarget={texture:s,framebuffer:r,width:t,height:e}}i.bindFramebuffer(i.FRAMEBUFFER,this.distanceTarget.framebuffer),i.drawBuffers([i.COLOR_ATTACHMENT0])}}const GM=768*2**20;class WM{constructor(t,e=GM){this.gl=t,this.memory=e,this.targets=new Pm(t),this.viewPasses=new Lm(t,this.targets),this.editTextures=new vM(t),this.vertices=t.createVertexArray()}background=[1,1,1];near=0;edited=!0;step=null;targets;inBands=!0;inOrder=!0;editable=!0;onOrder=null;compileTime=0;compiled=0;shownField=null;editTextures;viewPasses;camera=null;loading=0;programs=new Map;vertices;get level(){return this.shownField?.level??null}get uploaded(){return this.editTextures.uploaded}get activeEdits(){return this.edited?this.editTextures.edits:null}get bytes(){return this.shownField?.textures.bytes??0}setSize(t,e){this.targets.setSize(t,e)}setCamera(t){this.camera=t}async load(t,e={}){const i=++this.loading,s=()=>i===this.loading;let r=0;for await(const o of wM(t,e.onArrival)){if(await this.take(o,s),!s())return;e.onLevel?.(++r,o.field.levels.length)}}async restore(){const{shownField:t}=this,{edits:e}=this.editTextures;this.programs.clear(),this.vertices=this.gl.createVertexArray(),this.shownField=null;for(const s of[this.targets,this.viewPasses,this.editTextures])s.forget();const i=++this.loading;this.setEdits(e),t&&await this.take(t.level,()=>i===this.loading)}async readEdits(t,e){return await DM(t,e)}async prepare(){}setEdits(t){this.editTextures.set(t),this.putLayers()}render(t={}){const{gl:e,shownField:i,camera:s,activeEdits:r}=this;if(!i||!s||e.isContextLost())return!1;const{level:o,textures:a}=i,{width:l,height:c}=this.targets,h={K:o.header.steps.length,contracted:o.field.contracted,edited:r!==null,edits:r&&pM(r.edits),normals:t.normals??!1,graded:r!==null&&fM(r.rows,r.edits),bent:r!==null&&mM(r.rows,r.edits),count:t.count??!1},{program:d,uniform:u}=this.program(h,o.field.brick);this.targets.bind(h.normals),e.useProgram(d),e.bindVertexArray(this.vertices),Bs(this.gl);const p=r&&o.last?r.occupancy:o.occupancy;AM(e,u,o,a.layout,p,this.step??o.field.step),CM(e,u,s,this.targets),e.uniform1f(u("near"),this.near),e.uniform3f(u("background"),...this.background);let g=0;const x=(M,b,E)=>{e.activeTexture(e.TEXTURE0+g),e.bindTexture(b,E),e.uniform1i(u(M),g++)};x("densityAtlas",e.TEXTURE_3D,a.density),x("brickIndex",e.TEXTURE_3D,a.index),x("bricks",e.TEXTURE_3D,r?o.last?this.editTextures.bricks:i.fullOccupancy:i.occupancy),a.colors.forEach((M,b)=>x(`colorAtlas${b}`,e.TEXTURE_3D,M)),r&&(x("lattice",e.TEXTURE_2D,this.editTextures.bind(d)),e.uniform1i(u("editCount"),r.edits),e.uniform1i(u("boxCount"),r.boxes),e.uniform1i(u("preserveOpacity"),Number(r.preserveOpacity)),e.uniform1i(u("layered"),Number(i.layered)));const{first:m,count:f}=t.rows??{first:0,count:c},_=t.columns??{first:0,count:l};return e.enable(e.SCISSOR_TEST),e.scissor(_.first,m,_.count,f),e.drawArrays(e.TRIANGLES,0,3),e.disable(e.SCISSOR_TEST),zs(e),!0}show(t,e,i=null,s="color"){const{gl:r}=this;r.bindFramebuffer(r.FRAMEBUFFER,i),r.bindVertexArray(this.vertices),Bs(this.gl),this.viewPasses.show(s,this.reach,t,e),zs(this.gl)}read(t=!1){return this.targets.read(t)}distances(t){this.gl.bindVertexArray(this.vertices),Bs(this.gl);const e=this.viewPasses.distances(t);return zs(this.gl),e}wait(){this.targets.wait()}dispose(){this.loading++,this.drop();for(const t of[this.targets,this.viewPasses,this.editTextures])t.dispose();for(const{program:t}of this.programs.values())this.gl.deleteProgram(t);this.programs.clear(),this.gl.deleteVertexArray(this.vertices)}async take(t,e){const i=await yh.upload(this.gl,this.memory,t,this.layers,e);i!==null&&(this.drop(),this.shownField=i,this.putLayers())}get layers(){return this.editTextures.edits?.layers??[]}putLayers(){try{this.shownField&&this.editTextures.countUpload(this.shownField.putLayers(this.layers))}catch(t){throw t instanceof bh&&this.drop(),t}}drop(){this.shownField?.dispose(),this.shownField=null}get reach(){const{shownField:t,camera:e}=this;return!t||!e?[0,1]:Mm(t.level.field.bounds,e)}program(t,e){const i=JSON.stringify([t,e]);let s=this.programs.get(i);return s||(s=Fs(this.gl,kr,TM(t,e)),this.programs.set(i,s),this.compileTime=s.milliseconds,this.compiled+=1),s}}const Dm="cagespla",XM=1,qM=256,zn=8;function Ds(n){return 4*Math.ceil(3*((n+1)**2-1)/16)}async function*Im(n,t,e){const i=new Ua(n,e);try{const s=await Js.open(i,Dm,XM),{header:r}=s;t(r);let o=0;for(const[a,l]of r.levels.entries()){const c=l-o,h=async M=>await s.read(`${a}.${M}`),d=await s.read(`${a}.chunks`),u=Nm(d,await h("means"),c),p=await h("rotations"),g=await h("scales"),x=await h("opacities"),m=await h("colors"),f=$M(u,Oi(p),Oi(g),Oi(x),Oi(m)),_=YM(await h("sh"),c,r.degree);yield{header:r,first:o,count:c,last:a===r.levels.length-1&&!r.nodes,means:u,records:f,harmonics:_},o=l}}finally{i.cancel()}}function Oi(n){const t=n.length/2,e=new Uint16Array(t);for(let i=0;i<t;i++)e[i]=n[i]<<8|n[t+i];return e}function Nm(n,t,e){const i=t.length/(3*e),s=256**i-1,r=new Float32Array(3*e);for(let o=0;o<e;o++){const a=6*Math.floor(o/qM);for(let l=0;l<3;l++){let c=0;for(let d=0;d<i;d++)c=256*c+t[(3*d+l)*e+o];const h=n[a+l];r[3*o+l]=h+(n[a+3+l]-h)*c/s}}return r}function $M(n,t,e,i,s){const r=i.length,o=new Uint32Array(n.buffer),a=new Uint32Array(zn*r);for(let l=0;l<r;l++){const c=zn*l;a[c]=o[3*l],a[c+1]=o[3*l+1],a[c+2]=o[3*l+2],a[c+3]=s[l]|s[r+l]<<16,a[c+4]=t[l]|t[r+l]<<16,a[c+5]=t[2*r+l]|i[l]<<16,a[c+6]=e[l]|e[r+l]<<16,a[c+7]=e[2*r+l]|s[2*r+l]<<16}return a}function YM(n,t,e){const i=4*Ds(e),s=new Uint8Array(i*t),r=3*((e+1)**2-1);for(let o=0;o<r;o++)for(let a=0;a<t;a++)s[i*a+o]=n[t*o+a];return new Uint32Array(s.buffer)}function Hd(n){const t=n.getExtension("EXT_color_buffer_float");return t&&n.getExtension("EXT_float_blend")?{color:n.RGBA16F,distance:n.R32F,isByte:!1}:t??n.getExtension("EXT_color_buffer_half_float")?{color:n.RGBA16F,distance:n.RGBA16F,isByte:!1}:{color:n.RGBA8,distance:n.RGBA8,isByte:!0}}class KM{constructor(t,e){this.gl=t,this.formats=e}textures=null;framebuffer=null;width=0;height=0;begin(t,e,i){const{gl:s,formats:r}=this;if(this.textures&&(t!==this.width||e!==this.height||i&&!this.textures.normal)&&this.dispose(),!this.textures){this.width=t,this.height=e,this.textures={color:this.texture(r.color),distance:this.texture(r.distance),normal:i?this.texture(r.color):null},this.framebuffer=s.createFramebuffer(),s.bindFramebuffer(s.FRAMEBUFFER,this.framebuffer);const{color:o,distance:a,normal:l}=this.textures;for(const[c,h]of[o,a,l].entries())h&&s.framebufferTexture2D(s.FRAMEBUFFER,s.COLOR_ATTACHMENT0+c,s.TEXTURE_2D,h,0)}s.bindFramebuffer(s.FRAMEBUFFER,this.framebuffer),s.drawBuffers([s.COLOR_ATTACHMENT0,s.COLOR_ATTACHMENT1,...i?[s.COLOR_ATTACHMENT2]:[]]),s.viewport(0,0,t,e);for(let o=0;o<(i?3:2);o++)s.clearBufferfv(s.COLOR,o,[0,0,0,0])}forget(){this.textures=this.framebuffer=null}dispose(){const{gl:t,textures:e}=this;if(e)for(const i of Object.values(e))t.deleteTexture(i);t.deleteFramebuffer(this.framebuffer),this.forget()}texture(t){const{gl:e}=this,i=e.createTexture();return e.bindTexture(e.TEXTURE_2D,i),e.texStorage2D(e.TEXTURE_2D,1,t,this.width,this.height),e.texParameteri(e.TEXTURE_2D,e.TEXTURE_MIN_FILTER,e.NEAREST),e.texParameteri(e.TEXTURE_2D,e.TEXTURE_MAG_FILTER,e.NEAREST),e.bindTexture(e.TEXTURE_2D,null),i}}const Um='(function(){"use strict";class A{constructor(t,n=()=>{}){this.onArrival=n,this.source=(t instanceof ArrayBuffer?new Blob([t]).stream():t).getReader()}chunks=[];buffered=0;arrived=0;source;async take(t){for(;this.buffered<t;){const{value:s,done:c}=await this.source.read();if(c)throw new Error("the file of the field is truncated");this.chunks.push(s),this.buffered+=s.length,this.arrived+=s.length,this.onArrival(this.arrived)}const n=new Uint8Array(t);let e=0;for(;e<t;){const s=this.chunks[0],c=s.subarray(0,t-e);n.set(c,e),e+=c.length,c.length===s.length?this.chunks.shift():this.chunks[0]=s.subarray(c.length)}return this.buffered-=t,n}cancel(){this.source.cancel().catch(()=>{})}}async function b(o){const t=new Blob([o]).stream().pipeThrough(new DecompressionStream("deflate"));return await new Response(t).arrayBuffer()}class d{constructor(t,n,e){this.header=t,this.entries=n,this.reader=e}next=0;static async open(t,n,e){const s=await t.take(16),c=new DataView(s.buffer);if(String.fromCharCode(...s.subarray(0,8))!==n)throw new Error(`not a file of the kind "${n}"`);const r=c.getUint32(8,!0);if(r!==e)throw new Error(`"${n}" of version ${r}, this page reads ${e}; reload it`);const a=new TextDecoder().decode(await t.take(c.getUint32(12,!0))),i=JSON.parse(a);return new d(i,i.arrays,t)}get left(){return this.entries.slice(this.next).reduce((t,n)=>t+n.bytes,0)}async read(t){const n=this.entries.at(this.next);if(n?.name!==t)throw new Error(`the file of the field has no array "${t}" here`);this.next++;const e=await b(await this.reader.take(n.bytes));switch(n.type){case"u1":return new Uint8Array(e);case"u2":return new Uint16Array(e);case"i4":return new Int32Array(e);case"f4":return new Float32Array(e)}}}function p(o,t,n){const e=o>>15|t>>15<<1,s=[o,t,n].map(h=>((h&32767)-16384)/(16383*Math.SQRT2)),c=Math.sqrt(Math.max(0,1-s[0]**2-s[1]**2-s[2]**2)),[r,a,i,f]=[...s.slice(0,e),c,...s.slice(e)];return[1-2*(i*i+f*f),2*(a*i-r*f),2*(a*f+r*i),2*(a*i+r*f),1-2*(a*a+f*f),2*(i*f-r*a),2*(a*f-r*i),2*(i*f+r*a),1-2*(a*a+i*i)]}function k(o,t,[n,e]){const s=o.length/3,c=new Float32Array(9*s);for(let r=0;r<s;r++){const a=p(o[r],o[s+r],o[2*s+r]);for(let i=0;i<3;i++){const f=Math.exp(n+(e-n)*t[i*s+r]/65535);for(let h=0;h<3;h++)c[9*r+3*h+i]=a[3*h+i]*f}}return c}function m(o){const t=new Float32Array(o.length/9*6);for(let n=0,e=0;n<o.length;n+=9)for(let s=0;s<3;s++)for(let c=s;c<3;c++){let r=0;for(let a=0;a<3;a++)r+=o[n+3*s+a]*o[n+3*c+a];t[e++]=r}return t}const v=256;function w(o){const t=o.length/2,n=new Uint16Array(t);for(let e=0;e<t;e++)n[e]=o[e]<<8|o[t+e];return n}function S(o,t,n){const e=t.length/(3*n),s=256**e-1,c=new Float32Array(3*n);for(let r=0;r<n;r++){const a=6*Math.floor(r/v);for(let i=0;i<3;i++){let f=0;for(let u=0;u<e;u++)f=256*f+t[(3*u+i)*n+r];const h=o[a+i];c[3*r+i]=h+(o[a+3+i]-h)*f/s}}return c}const U="cagesped",M=2,g=16;async function x(o){const t=await d.open(new A(o),U,M),{count:n,changed:e,packed:s,log_scales:c}=t.header,r=async y=>await t.read(y),a=async y=>await t.read(y),i=E(await r("hidden"),n),f=await t.read("sources"),h=s?S(await a("chunks"),await r("means"),e):await a("means"),u=s?m(k(w(await r("rotations")),w(await r("scales")),c)):await a("covariances"),l=w(await r("opacities")),B=w(await r("turns")),C=await t.read("gains");return{count:n,hidden:i,changed:e,means:h,records:R(f,h,u,l,B,C)}}function E(o,t){const n=new Uint8Array(t);for(let e=0;e<t;e++)n[e]=o[e>>3]>>(e&7)&1;return n}function R(o,t,n,e,s,c){const r=o.length,a=new Uint32Array(g*r),[i,f]=[new Uint32Array(t.buffer),new Uint32Array(n.buffer)];for(let h=0;h<r;h++){const u=g*h;for(let l=0;l<3;l++)a[u+l]=i[3*h+l];a[u+3]=o[h];for(let l=0;l<6;l++)a[u+4+l]=f[6*h+l];a[u+10]=s[h]|s[r+h]<<16,a[u+11]=s[2*r+h]|e[h]<<16;for(let l=0;r*l<c.length;l++)a[u+12+l]=c[r*l+h]}return a}self.onmessage=async({data:o})=>{const{file:t,answer:n}=o;try{const e=await x(t);n.postMessage({edits:e},[e.hidden.buffer,e.means.buffer,e.records.buffer])}catch(e){n.postMessage({why:e instanceof Error?e.message:String(e)})}},self.postMessage("ready")})();\n',Gd=typeof self<"u"&&self.Blob&&new Blob([Um],{type:"text/javascript;charset=utf-8"});function ZM(n){let t;try{if(t=Gd&&(self.URL||self.webkitURL).createObjectURL(Gd),!t)throw"";const e=new Worker(t,{name:n?.name});return e.addEventListener("error",()=>{(self.URL||self.webkitURL).revokeObjectURL(t)}),e}catch{return new Worker("data:text/javascript;charset=utf-8,"+encodeURIComponent(Um),{name:n?.name})}finally{t&&(self.URL||self.webkitURL).revokeObjectURL(t)}}function jM(n,t,e){const i=n>>15|t>>15<<1,s=[n,t,e].map(h=>((h&32767)-16384)/(16383*Math.SQRT2)),r=Math.sqrt(Math.max(0,1-s[0]**2-s[1]**2-s[2]**2)),[o,a,l,c]=[...s.slice(0,i),r,...s.slice(i)];return[1-2*(l*l+c*c),2*(a*l-o*c),2*(a*c+o*l),2*(a*l+o*c),1-2*(a*a+c*c),2*(l*c-o*a),2*(a*c-o*l),2*(l*c+o*a),1-2*(a*a+l*l)]}function QM(n,t,[e,i]){const s=n.length/3,r=new Float32Array(9*s);for(let o=0;o<s;o++){const a=jM(n[o],n[s+o],n[2*s+o]);for(let l=0;l<3;l++){const c=Math.exp(e+(i-e)*t[l*s+o]/65535);for(let h=0;h<3;h++)r[9*o+3*h+l]=a[3*h+l]*c}}return r}function JM(n){const t=new Float32Array(n.length/9*6);for(let e=0,i=0;e<n.length;e+=9)for(let s=0;s<3;s++)for(let r=s;r<3;r++){let o=0;for(let a=0;a<3;a++)o+=n[e+3*s+a]*n[e+3*r+a];t[i++]=o}return t}const t1="cagesped",e1=2,wa=16;async function n1(n){const t=await Js.open(new Ua(n),t1,e1),{count:e,changed:i,packed:s,log_scales:r}=t.header,o=async x=>await t.read(x),a=async x=>await t.read(x),l=i1(await o("hidden"),e),c=await t.read("sources"),h=s?Nm(await a("chunks"),await o("means"),i):await a("means"),d=s?JM(QM(Oi(await o("rotations")),Oi(await o("scales")),r)):await a("covariances"),u=Oi(await o("opacities")),p=Oi(await o("turns")),g=await t.read("gains");return{count:e,hidden:l,changed:i,means:h,records:s1(c,h,d,u,p,g)}}function i1(n,t){const e=new Uint8Array(t);for(let i=0;i<t;i++)e[i]=n[i>>3]>>(i&7)&1;return e}function s1(n,t,e,i,s,r){const o=n.length,a=new Uint32Array(wa*o),[l,c]=[new Uint32Array(t.buffer),new Uint32Array(e.buffer)];for(let h=0;h<o;h++){const d=wa*h;for(let u=0;u<3;u++)a[d+u]=l[3*h+u];a[d+3]=n[h];for(let u=0;u<6;u++)a[d+4+u]=c[6*h+u];a[d+10]=s[h]|s[o+h]<<16,a[d+11]=s[2*o+h]|i[h]<<16;for(let u=0;o*u<r.length;u++)a[d+12+u]=r[o*u+h]}return a}const r1=1<<20;let o1=null;async function a1(n){const t=n.byteLength>r1?await(o1??=l1()):null;if(t===null)return await n1(n);const{port1:e,port2:i}=new MessageChannel,s=new Promise(o=>{e.onmessage=({data:a})=>o(a)});t.postMessage({file:n,answer:i},[n,i]);const r=await s;if(e.close(),"why"in r)throw new Error(r.why);return r.edits}function l1(){return new Promise(n=>{const t=new ZM;t.onmessage=()=>n(t),t.onerror=()=>n(null)})}const Sl=65536;function c1(n,t){const{means:e,hidden:i,changed:s}=n,[r,o,a]=t.axis,{offset:l,near:c}=t,h=e.length/3,d=h+(s?s.length/3:0),u=new Float32Array(d),p=new Uint32Array(u.buffer),g=new Uint32Array(d);let x=0;for(let b=0;b<h;b++){if(i!==null&&i[b]===1)continue;const E=r*e[3*b]+o*e[3*b+1]+a*e[3*b+2]+l;E<c||(u[x]=E,g[x++]=b)}if(s!==null)for(let b=h;b<d;b++){const E=3*(b-h),T=r*s[E]+o*s[E+1]+a*s[E+2]+l;T>=c&&(u[x]=T,g[x++]=b)}const m=new Uint32Array(Sl),f=new Uint32Array(x),_=new Uint32Array(x);for(let b=0;b<x;b++)m[p[b]&65535]++;let M=0;for(let b=Sl-1;b>=0;b--){const E=m[b];m[b]=M,M+=E}for(let b=x-1;b>=0;b--)f[m[p[b]&65535]++]=b;m.fill(0);for(let b=0;b<x;b++)m[p[b]>>>16]++;M=0;for(let b=Sl-1;b>=0;b--){const E=m[b];m[b]=M,M+=E}for(let b=0;b<x;b++){const E=f[b];_[m[p[E]>>>16]++]=g[E]}return _}const Om=`(function(){"use strict";function R(s,l){const{means:f,hidden:w,changed:r}=s,[y,g,m]=l.axis,{offset:b,near:p}=l,i=f.length/3,A=i+(r?r.length/3:0),h=new Float32Array(A),a=new Uint32Array(h.buffer),d=new Uint32Array(A);let t=0;for(let n=0;n<i;n++){if(w!==null&&w[n]===1)continue;const e=y*f[3*n]+g*f[3*n+1]+m*f[3*n+2]+b;e<p||(h[t]=e,d[t++]=n)}if(r!==null)for(let n=i;n<A;n++){const e=3*(n-i),I=y*r[e]+g*r[e+1]+m*r[e+2]+b;I>=p&&(h[t]=I,d[t++]=n)}const o=new Uint32Array(65536),U=new Uint32Array(t),D=new Uint32Array(t);for(let n=0;n<t;n++)o[a[n]&65535]++;let c=0;for(let n=65535;n>=0;n--){const e=o[n];o[n]=c,c+=e}for(let n=t-1;n>=0;n--)U[o[a[n]&65535]++]=n;o.fill(0);for(let n=0;n<t;n++)o[a[n]>>>16]++;c=0;for(let n=65535;n>=0;n--){const e=o[n];o[n]=c,c+=e}for(let n=0;n<t;n++){const e=U[n];D[o[a[e]>>>16]++]=d[e]}return D}let u={means:new Float32Array(0),hidden:null,changed:null};self.onmessage=({data:s})=>{if(!("sort"in s)){u={...u,...s};return}const l=R(u,s.sort);self.postMessage(l,{transfer:[l.buffer]})}})();
`,Wd=typeof self<"u"&&self.Blob&&new Blob([Om],{type:"text/javascript;charset=utf-8"});function h1(n){let t;try{if(t=Wd&&(self.URL||self.webkitURL).createObjectURL(Wd),!t)throw"";const e=new Worker(t,{name:n?.name});return e.addEventListener("error",()=>{(self.URL||self.webkitURL).revokeObjectURL(t)}),e}catch{return new Worker("data:text/javascript;charset=utf-8,"+encodeURIComponent(Om),{name:n?.name})}finally{t&&(self.URL||self.webkitURL).revokeObjectURL(t)}}const u1=32768;class Xd{onOrder=null;sortedHere=0;order=null;firstOrder=null;worker=null;hasNoWorker=!1;postedSet=null;running=null;preparing=null;next=null;outdated=!1;orderFor(t,e,i){this.firstOrder?.set===t&&(this.order=this.firstOrder,this.firstOrder=null);const{order:s}=this,r=s?.set===t?s:null;if(r!==null&&Nc(r.depths,e))return r;if(r===null||i||this.isQuick(t))return this.next=null,this.outdated=this.running!==null,this.sortedHere+=1,this.order={numbers:c1(t,e),set:t,depths:e};const{running:o}=this,a=o?.set===t&&Nc(o.depths,e);return this.next=a?null:{set:t,depths:e,prepared:null},this.postNext(),r}prepare(t,e){return this.isQuick(t)?Promise.resolve():new Promise(i=>{this.preparing?.prepared?.(),this.preparing={set:t,depths:e,prepared:i},this.postNext()})}dispose(){this.worker?.terminate();const t=[this.running,this.preparing];this.worker=this.postedSet=this.running=this.preparing=this.next=this.firstOrder=this.order=null;for(const e of t)e?.prepared?.()}isQuick({means:t,changed:e}){return this.hasNoWorker||t.length+(e?.length??0)<=3*u1}postNext(){const t=this.preparing??this.next;if(this.running!==null||t===null)return;t===this.preparing?this.preparing=null:this.next=null,this.running=t,this.worker??=this.startWorker();const{set:e,depths:i}=t,s=r=>this.worker?.postMessage(r);this.postedSet?.means!==e.means&&s({means:e.means}),this.postedSet!==e&&s({hidden:e.hidden,changed:e.changed}),this.postedSet=e,s({sort:i})}startWorker(){const t=new h1;return t.onmessage=({data:e})=>this.takeAnswer(e),t.onerror=()=>{this.hasNoWorker=!0,this.dispose(),this.onOrder?.()},t}takeAnswer(t){const{running:e,outdated:i}=this;if(this.running=null,this.outdated=!1,e===null)return;const s={numbers:t,set:e.set,depths:e.depths};e.prepared!==null?(this.firstOrder=s,e.prepared()):this.order?.set===e.set&&!i&&(this.order=s,this.onOrder?.()),this.postNext()}}function Nc(n,t){return n.offset===t.offset&&n.near===t.near&&n.axis.every((e,i)=>e===t.axis[i])}function Sh({center:n},{c2w:t}){return[t[3]-n[0],t[7]-n[1],t[11]-n[2]]}function Fm(n,t){return Math.max(t,n.near)}function El(n,t,e){const{c2w:i}=t,[s,r,o]=Sh(n,t),a=[-i[2],-i[6],-i[10]];return{axis:a,offset:-(a[0]*s+a[1]*r+a[2]*o),near:Fm(n,e)}}function d1(n,t){const[e,i]=n.bounds;return Math.hypot(...Sh(n,t))+Math.hypot(...i.map((s,r)=>s-e[r]))}const p1=.02;function f1(n,t){const{radius:e,distance:i}=Bm(n,t);return e/i*(km(n,t)?1:p1)}function km(n,t){const{ray:e,radius:i}=Bm(n,t),{c2w:s}=t,r=a=>e.reduce((l,c,h)=>l+c*s[4*h+a],0),o=-r(2);return o>-i&&Math.abs(r(0))-i<=Math.max(o,i)*.5*t.width/t.fx&&Math.abs(r(1))-i<=Math.max(o,i)*.5*t.height/t.fy}function Bm({bounds:[n,t]},{c2w:e}){const i=n.map((o,a)=>.5*(t[a]-o)),s=n.map((o,a)=>o+i[a]-e[4*a+3]),r=Math.hypot(...i);return{ray:s,radius:r,distance:Math.max(Math.hypot(...s)-r,.1*r,1e-9)}}const m1=.5;class g1{constructor(t,e,i){this.nodes=t;const s=[e];for(const o of t)s.push(s[s.length-1]+o.count);if(this.isComplete=s[t.length]<=i,this.states=t.map(()=>"coarse"),this.seen=t.map(()=>0),this.isComplete){this.free.push(...s.slice(0,-1)),t.forEach((o,a)=>this.places.set(o,s[a]));return}const r=Math.max(...t.map(o=>o.count));for(let o=e;o+r<=i;o+=r)this.free.push(o)}isComplete;states;seen;places=new Map;free=[];views=0;get resident(){return this.states.filter(t=>t==="loading"||t==="stored").length}look(t){this.views+=1,this.nodes.forEach((e,i)=>{km(e,t)&&(this.seen[i]=this.views)})}next(t){const e=o=>t===null?-o:f1(this.nodes[o],t),i=this.largest(o=>this.states[o]==="coarse",e);if(i===null)return null;const s=this.nodes[i];if(this.isComplete||this.resident<this.free.length+this.places.size)return this.states[i]="loading",{node:s,evicted:null};if(t===null||this.seen[i]!==this.views)return null;const r=this.victim(e(i),e);return r===null?null:(this.states[i]="loading",this.states[r]="evicted",{node:s,evicted:this.nodes[r]})}place(t){const e=this.places.get(t)??this.free.shift();if(e===void 0)throw new Error("no place for a node of splats");return this.places.set(t,e),e}store(t){this.states[this.nodes.indexOf(t)]="stored"}release(t){if(this.states[this.nodes.indexOf(t)]="coarse",this.isComplete)return;const e=this.places.get(t);this.places.delete(t),e!==void 0&&this.free.push(e)}coarseInImage(){return this.nodes.filter((t,e)=>this.states[e]==="coarse"&&this.seen[e]===this.views).length}victim(t,e){const i=this.largest(r=>this.states[r]==="stored"&&this.seen[r]!==this.views,r=>-this.seen[r]);if(i!==null)return i;const s=this.largest(r=>this.states[r]==="stored",r=>-e(r));return s!==null&&e(s)<m1*t?s:null}largest(t,e){let i=null,s=-1/0;for(let r=0;r<this.nodes.length;r++)!t(r)||e(r)<=s||(i=r,s=e(r));return i}}const v1=2;class _1{constructor(t,e,i,s,r,o,a){this.store=t,this.nodes=e,this.open=i,this.apply=s,this.options=r,this.wanted=o,this.arrived=a;const l=e.reduce((c,h)=>Math.max(c,h.coarse[1]),0);this.residency=new g1(e,l,t.capacity)}residency;applying=Promise.resolve();isQueued=!1;storing=Promise.resolve();running=null;async load(t){const e=t();e!==null&&this.residency.look(e),this.running??=this.run(t).finally(()=>this.running=null),await this.running}look(t){const{residency:e}=this;e.look(t),!(e.isComplete||this.running!==null||e.coarseInImage()===0)&&this.load(()=>t).catch(i=>{this.options.onFailure?.(`details of the scene could not be loaded: ${String(i)}`)})}async run(t){const e=async()=>{for(let s=this.residency.next(t());s;s=this.residency.next(t())){if(!this.wanted())return;await this.loadNode(s.node,s.evicted)}};await Promise.all(Array.from({length:v1},e)),await this.applied();const i=this.residency.coarseInImage();this.wanted()&&i>0&&this.options.onCoarse?.(i,this.nodes.length)}async loadNode(t,e){let i=0;const s=o=>{this.arrived+=o-i,i=o,this.options.onArrival?.(this.arrived)};let r=!1;try{for await(const o of Im(await this.open(t.url),()=>{},s))this.storing=this.storing.then(async()=>{if(!this.wanted())return;const a=e;e=null,a!==null&&await this.evict(a),await this.store.storeNode(o,this.residency.place(t),t,this.wanted),this.residency.store(t)}),await this.storing,r=!0}finally{r||(this.residency.release(t),e!==null&&this.residency.store(e))}this.applied()}async evict(t){this.store.dropNode(t),await this.applied(),this.residency.release(t)}applied(){return this.isQueued?this.applying:(this.isQueued=!0,this.applying=this.applying.then(async()=>{this.isQueued=!1,await this.apply(),this.wanted()&&this.options.onDetails?.()}),this.applying)}}const We=2048,Uc=3,x1=`
uniform usampler2D order;       // numbers of splats, from far to near
uniform uint count;             // numbers in the order
uniform usampler2D records, harmonics, changed;
uniform uint own;               // splats of the field; higher numbers are changed splats
uniform vec3 eye;               // relative to the field's center
uniform mat3 W;                 // rows: x right, y down, z forward
uniform vec2 focal, center, size;
uniform vec4 limits;            // of (x, y) / z: low, high of x, of y
uniform float near, logLow, logStep, colorStep;

// Mean in pixels, x right and y down; A, k of the conic A (x + k y)^2 + D y^2.
layout(location = 0) out uvec4 place;
// D, opacity (0: not shown), distance, its slope along x.
layout(location = 1) out uvec4 shape;
// Color, slope of the distance along y.
layout(location = 2) out uvec4 tint;

${xh(ym)}

uvec4 texel(usampler2D from, uint n) { return texelFetch(from, ivec2(n % ${We}u, n / ${We}u), 0); }

// The quaternion (w, x, y, z as its y, z, w, x: xyz and w) of three numbers of 15 bits; see page_splats.encode_rotations.
vec4 rotation(uvec2 words) {
  uvec3 codes = uvec3(words.x & 65535u, words.x >> 16, words.y & 65535u);
  uint left = (codes.x >> 15) | (codes.y >> 15) << 1;
  vec3 c = (vec3(codes & 32767u) - 16384.0) / (16383.0 * sqrt(2.0));
  float most = sqrt(max(0.0, 1.0 - dot(c, c)));
  if (left == 0u) return vec4(c, most);
  if (left == 1u) return vec4(most, c.y, c.z, c.x);
  if (left == 2u) return vec4(c.y, most, c.z, c.x);
  return vec4(c.y, c.z, most, c.x);
}

vec3 rotated(vec4 q, vec3 v) { return v + 2.0 * cross(q.xyz, cross(q.xyz, v) + q.w * v); }

// The matrix of a changed splat's color: its gains, or a grade; see page_splat_edits.encode_gains and encode_colors.
mat3 colorMatrix(uvec4 words) {
  uint kind = words.x >> 30;
  if (kind == 0u) {
    vec3 gain = exp2((vec3(words.x & 1023u, words.x >> 10 & 1023u, words.x >> 20) - 512.0) / 128.0);
    return mat3(gain.x, 0.0, 0.0, 0.0, gain.y, 0.0, 0.0, 0.0, gain.z);
  }
  uvec4 even = words & 16383u, odd = words >> 14 & 16383u;
  uint last = (words.x >> 28 & 3u) << 12 | (words.w >> 28) << 8 | (words.z >> 28) << 4 | words.y >> 28;
  mat3 codes = mat3(even.x, odd.y, even.w, odd.x, even.z, odd.w, even.y, odd.z, last);
  float range = kind == 1u ? 2.0 : kind == 2u ? 8.0 : 32.0;
  return range / 8191.0 * (codes - mat3(8192, 8192, 8192, 8192, 8192, 8192, 8192, 8192, 8192));
}

mat3 cholesky(float xx, float xy, float xz, float yy, float yz, float zz) {
  float a = sqrt(max(xx, 1e-38));
  float b = xy / a, c = xz / a;
  float d = sqrt(max(yy - b * b, 0.0));
  float e = d > 1e-6 * a ? (yz - b * c) / d : 0.0;
  float f = sqrt(max(zz - c * c - e * e, 0.0));
  return mat3(a, b, c, 0.0, d, e, 0.0, 0.0, f);
}
`,b1=`
void main() {
  place = shape = tint = uvec4(0u);
#ifdef NORMALS
  normal = uvec4(0u);
#endif
  ivec2 here = ivec2(gl_FragCoord.xy);
  if (uint(here.y * ${We} + here.x) >= count) return;
  uint splat = texelFetch(order, here, 0).r;
  uint source = splat;
  vec3 mean;
  mat3 F;
  float o;
  vec4 turn = vec4(0.0, 0.0, 0.0, 1.0);
  float side = 1.0;             // -1 where the turn is that of a reflection, turned over
  mat3 grade = mat3(1.0);
  if (splat < own) {
    uvec4 first = texel(records, 2u * splat), second = texel(records, 2u * splat + 1u);
    mean = uintBitsToFloat(first.xyz);
    o = float(second.y >> 16) / 65535.0;
    vec3 s = exp(logLow + logStep * vec3(second.z & 65535u, second.z >> 16, second.w & 65535u));
    vec4 q = rotation(second.xy);
    F = mat3(s.x * rotated(q, vec3(1, 0, 0)), s.y * rotated(q, vec3(0, 1, 0)), s.z * rotated(q, vec3(0, 0, 1)));
  } else {
    uint n = 4u * (splat - own);
    uvec4 first = texel(changed, n), second = texel(changed, n + 1u), third = texel(changed, n + 2u);
    mean = uintBitsToFloat(first.xyz);
    source = first.w;
    vec4 C = uintBitsToFloat(second);
    F = cholesky(C.x, C.y, C.z, C.w, uintBitsToFloat(third.x), uintBitsToFloat(third.y));
    turn = rotation(third.zw);
    side = (third.w & 32768u) == 0u ? 1.0 : -1.0;
    o = float(third.w >> 16) / 65535.0;
    grade = colorMatrix(texel(changed, n + 3u));
  }
  vec3 offset = mean - eye;
  vec3 p = W * offset;
  if (p.z < near || o <= ALPHA_MIN) return;
  vec2 n = clamp(p.xy / p.z, limits.xz, limits.yw);
  vec3 rowX = vec3(W[0].x, W[1].x, W[2].x), rowY = vec3(W[0].y, W[1].y, W[2].y), rowZ = vec3(W[0].z, W[1].z, W[2].z);
  vec3 N0 = (focal.x / p.z * (rowX - n.x * rowZ)) * F;
  vec3 N1 = (focal.y / p.z * (rowY - n.y * rowZ)) * F;
  float a = dot(N0, N0), b = dot(N0, N1), c = dot(N1, N1);
  vec3 area = cross(N0, N1);
  float sharp = dot(area, area);
  float det = sharp + BLUR * (a + c + BLUR);
  float slopeDet = sharp + SLOPE_BLUR * (a + c + SLOPE_BLUR);
#ifdef ANTIALIASED
  o *= max(LEAST_COMPENSATION, sqrt(sharp / det));
#endif
  float reach = 2.0 * log(o / ALPHA_MIN);
  if (!(reach > 0.0)) return;
  vec2 at = p.xy / p.z * focal + center;
  vec2 extent = sqrt(reach * (vec2(a, c) + BLUR));
  if (any(lessThanEqual(at + extent, vec2(0.0))) || any(greaterThanEqual(at - extent, size))) return;
  place = floatBitsToUint(vec4(at, (c + BLUR) / det, -b / (c + BLUR)));
  float distance = length(offset);
  vec3 d = offset / distance;
  vec3 along = d * F;
  float alongU = dot(along, N0), alongV = dot(along, N1);
  vec2 slope = vec2(alongU * (c + SLOPE_BLUR) - alongV * b, alongV * (a + SLOPE_BLUR) - alongU * b) / slopeDet;
  shape = floatBitsToUint(vec4(1.0 / (c + BLUR), o, distance, slope.x));
#ifdef NORMALS
  vec3 axis = flattest(F);
  normal = floatBitsToUint(vec4(dot(axis, d) > 0.0 ? -axis : axis, 0.0));
#endif
  d = side * rotated(vec4(-turn.xyz, turn.w), d);
  tint = floatBitsToUint(vec4(max(grade * colorOf(source, d), 0.0), slope.y));
}
`,w1=`
layout(location = 3) out uvec4 normal;
vec3 flattest(mat3 F) {
  mat3 C = F * transpose(F);
  mat3 B = mat3(cross(C[1], C[2]), cross(C[2], C[0]), cross(C[0], C[1]));
  for (int n = 0; n < 8; n++) {
    B /= max(B[0][0] + B[1][1] + B[2][2], 1e-37);
    B = B * B;
  }
  vec3 length2 = vec3(dot(B[0], B[0]), dot(B[1], B[1]), dot(B[2], B[2]));
  vec3 axis = length2.x >= length2.y && length2.x >= length2.z ? B[0] : length2.y >= length2.z ? B[1] : B[2];
  return axis / max(length(axis), 1e-37);
}
`;function y1(n){const t=Ds(n)/4,e=(n+1)**2,i=[...n>0?[`uniform float steps[${e-1}];`]:[],"vec3 colorOf(uint splat, vec3 d) {","  uvec2 last = texel(records, 2u * splat + 1u).zw;","  uint both = texel(records, 2u * splat).w;",`  vec3 rgb = 0.5 + ${Dc[0]} * colorStep * (vec3(both & 65535u, both >> 16, last.y >> 16) - 32768.0);`,...Array.from({length:t},(s,r)=>`  uvec4 t${r} = texel(harmonics, ${t}u * splat + ${r}u);`)];for(let s=1;s<e;s++){const r=[0,1,2].map(o=>{const a=3*(s-1)+o;return`(t${a>>4}.${"xyzw"[a>>2&3]} >> ${8*(a&3)} & 255u)`});i.push(`  rgb += (steps[${s-1}] * (${Dc[s]})) * (vec3(${r.join(", ")}) - 128.0);`)}return[...i,"  return rgb;","}"].join(`
`)}function S1(n){return["#version 300 es","precision highp float;","precision highp int;","precision highp usampler2D;",...n.antialiased?["#define ANTIALIASED"]:[],...n.normals?["#define NORMALS"]:[],x1,n.normals?w1:"",y1(n.degree),b1].join(`
`)}const zm=xh(ym),E1=`#version 300 es
${zm}
precision highp float;
precision highp int;
precision highp usampler2D;
uniform usampler2D places, shapes, tints;
uniform vec2 size;
flat out vec4 where;
flat out vec4 how;
flat out vec4 color;
#ifdef NORMALS
uniform usampler2D normals;
flat out vec3 axis;
#endif
void main() {
  gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
  int splat = gl_VertexID / 6, side = gl_VertexID - 6 * splat;
  ivec2 here = ivec2(splat % ${We}, splat / ${We});
  how = uintBitsToFloat(texelFetch(shapes, here, 0));
  if (how.y <= 0.0) return;
  where = uintBitsToFloat(texelFetch(places, here, 0));
  color = uintBitsToFloat(texelFetch(tints, here, 0));
#ifdef NORMALS
  axis = uintBitsToFloat(texelFetch(normals, here, 0)).xyz;
#endif
  float reach = 2.0 * log(how.y / ALPHA_MIN);
  // Two triangles: corners 0 1 2 and 3 2 1.
  int number = side < 3 ? side : 6 - side;
  vec2 corner = vec2(float(number & 1), float(number >> 1)) * 2.0 - 1.0;
  vec2 at = corner * (sqrt(reach / vec2(where.z, how.x)) + 0.01);
  at = where.xy + vec2(at.x - where.w * at.y, at.y);
  gl_Position = vec4(2.0 * at.x / size.x - 1.0, 1.0 - 2.0 * at.y / size.y, 0.0, 1.0);
}`,M1=`#version 300 es
${zm}
precision highp float;
flat in vec4 where;
flat in vec4 how;
flat in vec4 color;
uniform vec2 size;
uniform float unit;                 // of distances
layout(location = 0) out vec4 outColor;
layout(location = 1) out vec4 outDepth;
#ifdef NORMALS
flat in vec3 axis;
layout(location = 2) out vec4 outNormal;
#endif
void main() {
  vec2 d = vec2(gl_FragCoord.x, size.y - gl_FragCoord.y) - where.xy;
  float l = d.x + where.w * d.y;
  float q = where.z * l * l + how.x * d.y * d.y;
  float a = min(how.y * exp(-0.5 * q), ALPHA_MAX);
  if (a < ALPHA_MIN) discard;
  outColor = vec4(a * color.rgb, a);
  outDepth = vec4(a * unit * (how.z + how.w * d.x + color.w * d.y), 0.0, 0.0, a);
#ifdef NORMALS
  outNormal = vec4(a * (0.5 + 0.5 * axis), a);
#endif
}`,T1=`#version 300 es
precision highp float;
precision highp int;
uniform sampler2D gathered, distances;
uniform vec3 background;
uniform float unit;
layout(location = 0) out vec4 outColor;
layout(location = 1) out uint outDepth;
#ifdef NORMALS
uniform sampler2D axes;
layout(location = 2) out vec4 outNormal;
#endif
vec4 eightBits(vec4 v) { return (floor(255.0 * clamp(v, 0.0, 1.0) + 0.5) + 0.25) / 255.0; }
void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  vec4 sum = texelFetch(gathered, at, 0);
  outColor = eightBits(vec4(sum.rgb + (1.0 - sum.a) * background, sum.a));
  float distance = texelFetch(distances, at, 0).r / unit;
  outDepth = floatBitsToUint(sum.a > 1e-6 ? distance / sum.a : intBitsToFloat(0x7f800000));
#ifdef NORMALS
  vec4 both = texelFetch(axes, at, 0);
  vec3 normal = 2.0 * both.rgb - both.a;
  float length_ = length(normal);
  outNormal = eightBits(vec4(length_ > 1e-3 ? 0.5 + 0.5 * normal / length_ : vec3(0.5), sum.a));
#endif
}`;function Ml(n,t){const e=n.indexOf(`
`)+1;return n.slice(0,e)+t.map(i=>`#define ${i}
`).join("")+n.slice(e)}class A1{constructor(t){this.gl=t}order=null;outputs=[];framebuffer=null;rows=0;reserve(t,e){const{gl:i}=this,s=Math.ceil(t/We),r=Uc+(e?1:0);if(s<=this.rows&&r<=this.outputs.length)return!1;const o=Math.max(r,this.outputs.length);this.rows=Math.max(s,this.rows),this.drop(),this.order=this.texture(i.R32UI),this.outputs=Array.from({length:o},()=>this.texture(i.RGBA32UI)),this.framebuffer=i.createFramebuffer(),i.bindFramebuffer(i.FRAMEBUFFER,this.framebuffer);for(const[a,l]of this.outputs.entries())i.framebufferTexture2D(i.FRAMEBUFFER,i.COLOR_ATTACHMENT0+a,i.TEXTURE_2D,l,0);return!0}put(t){const{gl:e}=this,i=Math.floor(t.length/We),s=t.length-i*We;mi(e),e.bindTexture(e.TEXTURE_2D,this.order),e.texSubImage2D(e.TEXTURE_2D,0,0,0,We,i,e.RED_INTEGER,e.UNSIGNED_INT,t),s>0&&e.texSubImage2D(e.TEXTURE_2D,0,0,i,s,1,e.RED_INTEGER,e.UNSIGNED_INT,t,i*We),e.bindTexture(e.TEXTURE_2D,null)}bind(t,e){const{gl:i}=this;i.bindFramebuffer(i.FRAMEBUFFER,this.framebuffer),i.drawBuffers(this.outputs.map((s,r)=>r<Uc||e?i.COLOR_ATTACHMENT0+r:i.NONE)),i.viewport(0,0,We,Math.ceil(t/We))}dispose(){this.drop(),this.rows=0}drop(){const{gl:t}=this;for(const e of[this.order,...this.outputs])t.deleteTexture(e);t.deleteFramebuffer(this.framebuffer),this.order=this.framebuffer=null,this.outputs=[]}texture(t){const{gl:e}=this,i=e.createTexture();return e.bindTexture(e.TEXTURE_2D,i),e.texStorage2D(e.TEXTURE_2D,1,t,We,this.rows),Na(e,e.TEXTURE_2D,e.NEAREST),e.bindTexture(e.TEXTURE_2D,null),i}}const qd=.3;class $d{constructor(t,e,i){this.gl=t,this.targets=e,this.blendTarget=new KM(t,i),this.projection=new A1(t),this.vertices=t.createVertexArray()}compileTime=0;compiled=0;programs=new Map;blendTarget;projection;vertices;uploadedOrder=null;draw(t){const{gl:e,blendTarget:i}=this,{store:s,camera:r,normals:o,rows:a,columns:l}=t,c=this.project(t);i.begin(this.targets.width,this.targets.height,o),e.enable(e.SCISSOR_TEST),e.scissor(l.first,a.first,l.count,a.count);const h=i.formats.isByte?1/d1(s.header,r):1;c>0&&this.blend(c,o,h),this.resolve(o,h,t.background),e.disable(e.SCISSOR_TEST)}bindVertices(){this.gl.bindVertexArray(this.vertices)}dispose(){const{gl:t}=this;this.uploadedOrder=null,this.blendTarget.dispose(),this.projection.dispose();for(const{program:e}of this.programs.values())t.deleteProgram(e);this.programs.clear(),t.deleteVertexArray(this.vertices)}project({store:t,changed:e,camera:i,near:s,order:r,normals:o}){const{gl:a}=this,{degree:l,antialiased:c,steps:h,log_scales:d,color_step:u}=t.header,p=r.numbers.length;if(p===0)return 0;const{program:g,uniform:x}=this.programFor(`project${l}${c}${o}`,()=>Fs(a,kr,S1({degree:l,antialiased:c,normals:o}))),{projection:m}=this;return(m.reserve(p,o)||this.uploadedOrder!==r)&&m.put(r.numbers),this.uploadedOrder=r,m.bind(p,o),a.useProgram(g),this.bindVertices(),this.setView(x,t,i,s),l>0&&a.uniform1fv(x("steps"),h),a.uniform1ui(x("own"),t.count),a.uniform1f(x("logLow"),d[0]),a.uniform1f(x("logStep"),(d[1]-d[0])/65535),a.uniform1f(x("colorStep"),u),a.uniform1ui(x("count"),p),this.bind(x,"order",m.order,0),this.bind(x,"records",t.records.texture,1),this.bind(x,"harmonics",t.harmonics.texture,2),this.bind(x,"changed",(e??t.records).texture,3),a.drawArrays(a.TRIANGLES,0,3),p}blend(t,e,i){const{gl:s}=this,r=e?["NORMALS"]:[],{program:o,uniform:a}=this.programFor(`blend${e}`,()=>Fs(s,Ml(E1,r),Ml(M1,r)));s.useProgram(o),this.bindVertices(),["places","shapes","tints",...e?["normals"]:[]].forEach((c,h)=>this.bind(a,c,this.projection.outputs[h],h)),s.uniform2f(a("size"),this.targets.width,this.targets.height),s.uniform1f(a("unit"),i),s.enable(s.BLEND),s.blendEquation(s.FUNC_ADD),s.blendFunc(s.ONE,s.ONE_MINUS_SRC_ALPHA),s.drawArrays(s.TRIANGLES,0,6*t),s.disable(s.BLEND)}resolve(t,e,i){const{gl:s}=this,{program:r,uniform:o}=this.programFor(`resolve${t}`,()=>Fs(s,kr,Ml(T1,t?["NORMALS"]:[])));this.targets.bind(t),s.useProgram(r),this.bindVertices();const{color:a,distance:l,normal:c}=this.blendTarget.textures;this.bind(o,"gathered",a,0),this.bind(o,"distances",l,1),c&&t&&this.bind(o,"axes",c,2),s.uniform3f(o("background"),...i),s.uniform1f(o("unit"),e),s.drawArrays(s.TRIANGLES,0,3)}bind(t,e,i,s){const{gl:r}=this;r.activeTexture(r.TEXTURE0+s),r.bindTexture(r.TEXTURE_2D,i),r.uniform1i(t(e),s)}setView(t,{header:e},i,s){const{gl:r}=this,{width:o,height:a}=this.targets,{c2w:l}=i,[c,h]=[i.fx,i.cx].map(m=>m*o/i.width),[d,u]=[i.fy,i.cy].map(m=>m*a/i.height),[p,g]=[.5*qd*o/c,.5*qd*a/d];r.uniform3f(t("eye"),...Sh(e,i));const x=[l[0],-l[1],-l[2],l[4],-l[5],-l[6],l[8],-l[9],-l[10]];r.uniformMatrix3fv(t("W"),!1,x),r.uniform2f(t("focal"),c,d),r.uniform2f(t("center"),h,u),r.uniform2f(t("size"),o,a),r.uniform4f(t("limits"),-h/c-p,(o-h)/c+p,-u/d-g,(a-u)/d+g),r.uniform1f(t("near"),Fm(e,s))}programFor(t,e){let i=this.programs.get(t);return i||(i=e(),this.programs.set(t,i),this.compileTime=i.milliseconds,this.compiled+=1),i}}const Yd=128;class Sr{constructor(t,e){this.gl=t,this.rows=Math.max(1,Math.ceil(e/(4*We)));const i=wh(t,t.MAX_TEXTURE_SIZE);if(this.rows>i)throw new rs(`the splats take ${this.rows} rows of a texture, more than the ${i} that the GPU has`);for(;t.getError()!==t.NO_ERROR;);if(this.texture=t.createTexture(),t.bindTexture(t.TEXTURE_2D,this.texture),t.texStorage2D(t.TEXTURE_2D,1,t.RGBA32UI,We,this.rows),Na(t,t.TEXTURE_2D,t.NEAREST),t.bindTexture(t.TEXTURE_2D,null),t.getError()===t.OUT_OF_MEMORY)throw this.dispose(),new Error("the GPU has not enough memory for the splats")}texture;rows;stride=4*We;async uploadRange(t,e,i,s){const{stride:r}=this;for(let o=Math.floor(e/r);o*r<i;o+=Yd){if(o*r>e&&await new Promise(a=>setTimeout(a)),!s())return;this.uploadRows(t,o,Math.min(o+Yd,Math.ceil(i/r)))}}uploadRows(t,e,i){const{gl:s,stride:r}=this;let o=t.subarray(e*r,i*r);if(o.length<(i-e)*r){const a=new Uint32Array((i-e)*r);a.set(o),o=a}mi(s),s.bindTexture(s.TEXTURE_2D,this.texture),s.texSubImage2D(s.TEXTURE_2D,0,0,e,We,i-e,s.RGBA_INTEGER,s.UNSIGNED_INT,o),s.bindTexture(s.TEXTURE_2D,null)}dispose(){this.gl.deleteTexture(this.texture)}}const Vm=16*(Uc+1)+4;class C1{constructor(t,e,i){this.gl=t,this.header=e;const{degree:s}=e,r=Ds(s),o=4*(zn+r)+Vm,a=Math.min(Math.floor(i/o),e.budget??1/0),l=e.nodes?Math.min(e.count,a):e.count;if(this.capacity=l,this.bytes=o*l,this.bytes>i)throw new rs(`the splats take ${Math.ceil(this.bytes/2**20)} MiB of the GPU, more than the ${Math.floor(i/2**20)} allowed`);this.means=new Float32Array(3*l),this.words=new Uint32Array(zn*l),this.harmonicWords=new Uint32Array(r*l),this.set={means:this.means.subarray(0,0),hidden:null,changed:null},this.records=new Sr(t,this.words.length),this.harmonics=new Sr(t,this.harmonicWords.length)}set;records;harmonics;bytes;capacity;stored=0;hidden=null;places=new Map;isOutdated=!1;means;words;harmonicWords;get count(){return this.set.means.length/3}get isWhole(){return this.count===this.header.count}async take(t,e){this.means.set(t.means,3*t.first),this.words.set(t.records,zn*t.first),this.harmonicWords.set(t.harmonics,Ds(t.header.degree)*t.first),await this.upload(t.first,t.first+t.count,e)}async storeNode(t,e,i,s){const r=Ds(t.header.degree);this.means.set(t.means,3*e),this.words.set(t.records,zn*e),this.harmonicWords.set(t.harmonics,r*e);const o=e+t.count;await this.records.uploadRange(this.words,zn*e,zn*o,s),await this.harmonics.uploadRange(this.harmonicWords,r*e,r*o,s),this.stored=Math.max(this.stored,o),this.places.set(i,[e,o]),this.isOutdated=!0}dropNode(t){this.isOutdated=this.places.delete(t)||this.isOutdated}setWithNodes(){if(!this.isOutdated)return null;this.isOutdated=!1;const t=new Uint8Array(this.stored);t.fill(1,this.header.levels[this.header.levels.length-1]);for(const[e,[i,s]]of this.places)t.fill(1,...e.coarse),t.fill(0,i,s);return this.hidden=t,{means:this.means.subarray(0,3*this.stored),hidden:t,changed:null}}async restore(t){const{count:e}=this;this.records=new Sr(this.gl,this.words.length),this.harmonics=new Sr(this.gl,this.harmonicWords.length),this.set={...this.set,means:this.means.subarray(0,0)},await this.upload(0,e,t)}dispose(){this.records.dispose(),this.harmonics.dispose()}async upload(t,e,i){const s=Ds(this.header.degree);await this.records.uploadRange(this.words,zn*t,zn*e,i),i()&&await this.harmonics.uploadRange(this.harmonicWords,s*t,s*e,i),i()&&(this.stored=Math.max(this.stored,e),this.set={means:this.means.subarray(0,3*e),hidden:this.hidden?.slice(0,e)??null,changed:null})}}const R1=768*2**20;class P1{constructor(t,e=R1,i=null){this.gl=t,this.memory=e,this.targets=new Pm(t),this.viewPasses=new Lm(t,this.targets),this.passes=new $d(t,this.targets,i??Hd(t))}background=[1,1,1];near=0;edited=!0;targets;inBands=!1;inOrder=!0;level=null;uploaded={last:0,total:0};viewPasses;sorters={before:new Xd,after:new Xd};passes;store=null;loader=null;changed=null;prepared=null;camera=null;loading=0;set onOrder(t){for(const e of Object.values(this.sorters))e.onOrder=t}get editable(){return this.count>0}get count(){return this.store?.count??0}get bytes(){return this.store?.bytes??0}get compileTime(){return this.passes.compileTime}get compiled(){return this.passes.compiled}get sortedHere(){return this.sorters.before.sortedHere+this.sorters.after.sortedHere}setSize(t,e){this.targets.setSize(t,e)}setCamera(t){this.camera=t,this.loader?.look(t)}async load(t,e={}){const i=++this.loading;this.loader=null;const s=()=>i===this.loading;let r=0,o=null,a=0;const l=c=>{s()&&(o=new C1(this.gl,c,this.memory))};try{const c=d=>{a=d,e.onArrival?.(d)};for await(const d of Im(t,l,c)){const u=o;if(!s()||u===null||(await u.take(d,s),!s()))return;this.store!==u&&(this.store?.dispose(),this.store=u),this.level={field:{background:d.header.background},last:d.last},e.onLevel?.(++r,d.header.levels.length)}const h=o;h?.header.nodes&&e.openBeside&&await this.loadNodes(h,h.header.nodes,e.openBeside,a,e,s)}finally{const c=o;c!==null&&this.store!==c&&c.dispose()}}async loadNodes(t,e,i,s,r,o){const a=()=>this.applyNodes(t,o),l=new _1(t,e,i,a,r,o,s);await l.load(()=>this.camera),o()&&(this.loader=l,this.level={field:{background:t.header.background},last:!0},r.onLevel?.(2,2))}async applyNodes(t,e){const i=t.setWithNodes();if(i===null)return;const{camera:s}=this;s!==null&&await this.sorters.before.prepare(i,El(t.header,s,this.near)),e()&&(t.set=i)}async restore(){const{gl:t,store:e,changed:i}=this;this.changed=null,this.targets.forget(),this.viewPasses.forget(),this.passes=new $d(t,this.targets,Hd(t));const s=++this.loading,{loader:r}=this,o=()=>s===this.loading;this.loader=null,await e?.restore(o),r!==null&&o()&&(r.wanted=o,this.loader=r),this.setEdits(i?.edits??null)}async readEdits(t){return await a1(t)}async prepare(t){const{store:e,camera:i}=this;if(e===null||i===null||!this.edited||t.changed===0||t.count!==e.header.count)return;const s=Zd(t,e);this.prepared={edits:t,set:s,own:e.set},await this.sorters.after.prepare(s,El(e.header,i,this.near))}setEdits(t){const{prepared:e}=this;if(this.changed?.texture.dispose(),this.changed=this.prepared=null,this.uploaded.last=0,t===null||t.changed===0&&!t.hidden.includes(1))return;if(this.store!==null&&t.count!==this.store.header.count)throw new Error(`edits of ${t.count} splats, the page has ${this.store.header.count}; reload it`);const i=this.bytes+(4*wa+Vm)*t.changed;if(i>this.memory)throw new rs(`the edited splats take ${Kd(i)} MiB of the GPU, more than the ${Kd(this.memory)} allowed`);const s=new Sr(this.gl,t.records.length);t.changed>0&&s.uploadRows(t.records,0,Math.ceil(t.records.length/s.stride));const{set:r,own:o}=e?.edits===t?e:{set:null,own:null};this.changed={edits:t,texture:s,set:r,own:o},this.uploaded.last=t.changed>0?t.records.byteLength:0,this.uploaded.total+=this.uploaded.last}render(t={}){const{gl:e,store:i,camera:s,background:r,near:o}=this;if(!i||i.count===0||!s||e.isContextLost())return!1;const{width:a,height:l}=this.targets,c=this.shownSet(i),h=El(i.header,s,o),u=(c===i.set?this.sorters.before:this.sorters.after).orderFor(c,h,t.sorted??!1);this.inOrder=Nc(u.depths,h),Bs(e);const p=t.rows??{first:0,count:l},g=t.columns??{first:0,count:a},x=this.changed?.texture??null;return this.passes.draw({store:i,changed:x,camera:s,near:o,order:u,normals:t.normals??!1,background:r,rows:p,columns:g}),zs(e),!0}show(t,e,i=null,s="color"){const{gl:r}=this;r.bindFramebuffer(r.FRAMEBUFFER,i),this.passes.bindVertices(),Bs(r),this.viewPasses.show(s,this.reach,t,e),zs(r)}read(t=!1){return this.targets.read(t)}distances(t){this.passes.bindVertices(),Bs(this.gl);const e=this.viewPasses.distances(t);return zs(this.gl),e}wait(){this.targets.wait()}dispose(){this.loading++,this.setEdits(null),this.store?.dispose(),this.store=this.level=null;for(const t of Object.values(this.sorters))t.dispose();this.viewPasses.dispose(),this.targets.dispose(),this.passes.dispose()}shownSet(t){const{changed:e}=this;return!this.edited||e===null?t.set:((e.set===null||e.own!==t.set)&&(e.own=t.set,e.set=Zd(e.edits,t)),e.set)}get reach(){const{store:t,camera:e}=this;return!t||!e?[0,1]:Mm(t.header.bounds,e)}}const Kd=n=>Math.ceil(n/2**20);function Zd(n,t){return{means:t.set.means,hidden:n.hidden,changed:L1(n,t)}}function L1({means:n,records:t,changed:e},i){if(i.isWhole)return n;const s=Float32Array.from(n);for(let r=0;r<e;r++)t[wa*r+3]>=i.count&&(s[3*r]=NaN);return s}const Hm=8;function D1(n,t,e){return n==="splats"?new P1(t,e):new WM(t,e)}function I1(n){return String.fromCharCode(...n.subarray(0,Hm))}async function N1(n){const t=n.getReader(),e=[];let i=0;for(;i<Hm;){const{value:a,done:l}=await t.read();if(l)break;e.push(a),i+=a.length}const s=new Uint8Array(i);let r=0;for(const a of e)s.set(a,r),r+=a.length;const o=new ReadableStream({start:a=>a.enqueue(s),pull:async a=>{const{value:l,done:c}=await t.read();c?a.close():a.enqueue(l)},cancel:async a=>await t.cancel(a)});return{kind:I1(s)===Dm?"splats":"voxels",source:o}}const U1=[.13,.13,.15],Tl="the field is not loaded yet";class O1{constructor(t,e){this.createDrawer=t,this.events=e}obstacle=Tl;drawer=null;edits=null;loads=0;kind=null;name=null;failedPage=null;decoded=null;queue=Promise.resolve();get requested(){return this.name!==null}load(t,e){t===this.name&&(this.failedPage===null||this.failedPage===e)||(this.clear(),this.name=t,this.fetch(t,e))}take(t,e,i){const s=performance.now(),{name:r}=this;this.queue=this.queue.then(async()=>{try{const{drawer:o}=this;if(o===null)throw new Error(Tl);const a=await o.readEdits(e,this.decoded);if(await o.prepare(a),r!==this.name)return;o.setEdits(a),this.decoded=a,this.edits={header:t,received:s,decoded:performance.now()},i(null)}catch(o){jd(o)&&this.events.failed(o.message),i(Qd(o))}})}dispose(){this.clear(),this.drawer?.dispose(),this.drawer=this.kind=null}clear(){this.name=this.failedPage=null,this.edits=null,this.decoded=null,this.obstacle=Tl,this.drawer?.setEdits(null)}async fetch(t,e){try{this.obstacle="the field is being loaded";const i=await fetch(`field${location.search}`);if(t!==this.name)return;if(!i.ok||i.body===null){this.obstacle=await i.text()||`the field cannot be loaded (${i.status})`;return}this.loads+=1;const s=Number(i.headers.get("Content-Length")),{kind:r,source:o}=await N1(i.body);if(t!==this.name){await o.cancel();return}const a=this.selectDrawer(r);await a.load(o,{onArrival:l=>this.events.progressed(s>0?Math.min(1,l/s):0),onLevel:()=>{t!==this.name||!a.editable||(a.background=a.level?.field.background??U1,this.obstacle=null,this.events.changed())}})}catch(i){if(t!==this.name)return;jd(i)?this.events.failed(i.message):(this.obstacle=Qd(i),this.failedPage=e)}finally{this.events.progressed(null)}}selectDrawer(t){return this.drawer!==null&&this.kind===t?this.drawer:(this.drawer?.dispose(),this.drawer=this.createDrawer(t),this.kind=t,this.drawer)}}function jd(n){return n instanceof rs||n instanceof bh}function Qd(n){return n instanceof Error?n.message:String(n)}const Gm={name:"idle"};function F1(n,t){return n.name==="closed"||n.name==="refused"&&(!t.connected||t.pictured===n.pictured)?n:!t.connected||!t.requested?Gm:t.drawable?{name:t.drawsAll?"all":"moving"}:{name:"loading"}}function k1(n){return n.name==="moving"||n.name==="all"?n.name:"nothing"}function B1(n){return n.name==="refused"||n.name==="closed"?n.why:null}const z1=120,V1=5,H1=.05,G1=12e4,W1=16;function X1(n){const t=new URLSearchParams(n).get("render");return t==="page"||t==="server"||t==="all"?t:"fastest"}class q1{constructor(t,e,i){this.host=t,this.request=e;const{viewport:s,store:r}=t,o=a=>{const l=i(a);return l.onOrder=()=>this.redraw(),l};this.scene=new O1(o,{changed:()=>this.refresh(),progressed:a=>r.set({loading:a}),failed:a=>this.fail(a)}),e==="server"?this.close("the page's address says so"):e==="fastest"&&s.software&&this.close("the page has no GPU"),r.watch(["figures","state","hello","connection"],a=>this.follow(a)),s.beforeFrame.push(()=>this.drawFrame()),s.canvas.addEventListener("webglcontextrestored",()=>void this.restore())}drawn=0;scene;location=new zE;state=Gm;announced=null;resolution=new iM;still=new rM;frame=Ho;slowFrames=0;sorted=!0;renderMs=0;applied=[];get why(){const t=B1(this.state);return this.state.name==="closed"?t:this.scene.obstacle??t}get draws(){return this.here!=="nothing"&&this.scene.obstacle===null&&this.scene.edits!==null}get here(){return k1(this.state)}get uploaded(){return this.scene.drawer?.uploaded??{last:0,total:0}}supersedes(t){const{edits:e}=this.scene;return!this.draws||e===null?!1:this.here==="all"||!this.host.camera.resting||t.revision<e.header.revision}recordServerFrame({width:t,height:e,full_width:i,render_ms:s,encode_ms:r}){const o=i<this.host.viewport.pixels.width;this.location.recordServer(t*e,s+r,o)}takeEdits(t,e){if(t.why!==null){this.refuse(t.why,t.picture);return}this.scene.take(t,e,i=>{i===null?this.confirmEdits(t):this.refuse(i,t.picture)})}confirmEdits(t){this.host.viewport.renderer.resetState(),this.applied.push(t.picture),this.refresh()}refuse(t,e){this.state.name!=="closed"&&(this.state={name:"refused",why:t,pictured:this.host.store.now.state?.pictured}),this.host.send({type:"presented",picture:e}),this.follow(this.host.store.now)}fail(t){this.close(t),this.host.say(`${t}; the server draws the pictures`,"warning")}close(t){this.state={name:"closed",why:t},this.scene.dispose(),this.refresh()}refresh(){const{viewport:t,store:e}=this.host;t.renderer.resetState(),this.follow(e.now),t.invalidate()}follow(t){const{hello:e,state:i,connection:s,figures:r}=t,o=e!==null&&i!==null&&s==="open";if(o&&this.state.name!=="closed"&&r.final&&this.scene.load(e.field,e.page),this.state=F1(this.state,{connected:o,pictured:i?.pictured,requested:this.scene.requested,drawable:this.scene.obstacle===null,drawsAll:this.drawsAll}),!o){s!=="open"&&(this.announced=null);return}const{page:a}=e,l=this.announced?.page===a?this.announced.here:"nothing";this.announced={here:this.here,page:a},this.here!==l&&(this.here==="nothing"&&this.host.camera.restate(),this.host.send({type:"drawing",here:this.here}))}get drawsAll(){if(this.scene.drawer?.level?.last!==!0)return!1;if(this.request==="all")return!0;const{software:t,pixels:e}=this.host.viewport;return!t&&this.location.chooseComplete(e.width*e.height)}redraw(){this.frame=Ho,this.host.viewport.invalidate()}async restore(){this.state.name!=="closed"&&(await this.scene.drawer?.restore(),this.frame=Ho,this.refresh())}drawFrame(){const{drawer:t}=this.scene;this.draws&&t!==null&&this.update(t);const{applied:e}=this;this.applied=[],e.length>0&&this.host.frames.acknowledge(e)}update(t){const{host:e,scene:i}=this,s=oM(e,t.level,i.edits),r=s.edits!==this.frame.edits||!bm(s,this.frame),o=r&&this.awaitsServer&&aM(s,this.frame);this.frame=s,!(o||lM(e.frames.last,e.camera,e.store,s.edits,this.here==="all"))&&(r?this.drawMoving(t):this.drawsStills&&this.drawStill(t),this.drawsStills&&!this.still.isComplete&&e.viewport.invalidate())}get drawsStills(){return this.here==="all"||this.scene.edits?.header.final===!1}drawMoving(t){const{width:e,height:i}=this.host.viewport.pixels,s=this.resolution.scale(e,i),[r,o]=[e,i].map(l=>Math.max(W1,Math.round(s*l))),a=this.render(t,r,o,{first:0,count:o},!1);this.still.restart(performance.now(),a&&s===1&&this.sorted),a?this.present(t,r,o):this.frame=Ho}drawStill(t){const{host:e,still:i}=this,{width:s,height:r}=e.viewport.pixels;if(i.isComplete){const{last:c}=e.frames;e.camera.resting&&c?.picture===0&&c.camera!==e.camera.seq&&e.frames.add(this.header(s,r),0,0);return}const o=t.inBands?this.resolution.bandRows(s,r):r,a=this.here==="all"||t.inBands?xm:sM,l=i.nextBand(performance.now(),r,o,a);l===null||!this.render(t,s,r,l,!0)||i.finishBand(l,r)&&this.present(t,s,r)}get awaitsServer(){return!this.drawsStills&&this.still.isComplete&&this.host.frames.last?.picture===0}render(t,e,i,s,r){const{view:o,before:a,split:l}=this.host.store.now,{viewport:c}=this.host,h=.5*i/Math.tan(c.camera.fov*Math.PI/360),[d,u]=[.5*e,.5*i];t.setSize(e,i),t.setCamera({c2w:c.c2w,width:e,height:i,fx:h,fy:h,cx:d,cy:u});const{compiled:p}=t,g=performance.now(),x=a||l===null?0:Math.round(l*e),m=[{edited:!1,first:0,end:x},{edited:!a,first:x,end:e}],f=o==="normals";let _=!0;this.sorted=!0;for(const{edited:M,first:b,end:E}of m)b!==E&&(t.edited=M,_=t.render({normals:f,sorted:r,rows:s,columns:{first:b,count:E-b}})&&_,this.sorted&&=t.inOrder);return _&&t.wait(),c.renderer.resetState(),_?(this.renderMs=performance.now()-g,t.compiled===p&&this.recordFrame(e*s.count,this.renderMs,i===c.pixels.height),!0):!1}present(t,e,i){const{host:s,scene:r}=this;if(this.state.name==="closed")return;const{view:o}=s.store.now,a=t.distances(G1);s.pictures.showOwn(a,(l,c,h)=>t.show(c,h,l,o)),this.drawn+=1,s.frames.add(this.header(e,i),r.edits?.received??0,r.edits?.decoded??0)}recordFrame(t,e,i){this.resolution.record(t,e),this.location.recordPage(t,e);const{width:s,height:r}=this.host.viewport.pixels,o=!i&&t<H1*s*r;this.slowFrames=e>z1&&o?this.slowFrames+1:0,this.request==="fastest"&&(this.slowFrames>=V1?this.close("the page's GPU is too slow"):this.location.serverIsFaster&&this.close(`the server is faster: ${this.location.summary}`))}header(t,e){const{camera:i,store:s,viewport:r}=this.host,o=this.drawsStills&&this.still.isComplete&&t===r.pixels.width;return cM(i,s,this.scene.edits,[t,e],o,this.renderMs)}}const Jd=96,$1=`
uniform vec4 part;
out vec2 at;
void main() {
  at = uv;
  vec2 place = part.xy + part.zw * vec2(uv.x, 1.0 - uv.y);
  gl_Position = vec4(2.0 * place.x - 1.0, 1.0 - 2.0 * place.y, 0.0, 1.0);
}`,Y1=`
uniform sampler2D picture;
uniform bool upright;
in vec2 at;
out vec4 color;
void main() { color = vec4(texture(picture, upright ? at : vec2(at.x, 1.0 - at.y)).rgb, 1.0); }`,K1=`
uniform sampler2D depthMap;
uniform mat4 toWorld;
uniform vec3 pictureEye;
uniform float far;
uniform bool flat_;
out vec2 at;
void main() {
  at = uv;
  vec2 device = 2.0 * uv - 1.0;
  gl_Position = vec4(device, 0.0, 1.0);
  if (!flat_) {
    vec4 through = toWorld * vec4(device, 0.5, 1.0);
    vec3 ray = normalize(through.xyz / through.w - pictureEye);
    float distance_ = min(texture(depthMap, vec2(uv.x, 1.0 - uv.y)).r, far);
    gl_Position = projectionMatrix * viewMatrix * vec4(pictureEye + distance_ * ray, 1.0);
  }
}`,Z1=`
uniform sampler2D picture;
in vec2 at;
out vec4 color;
void main() { color = vec4(texture(picture, at).rgb, 1.0); }`;class j1{constructor(t){this.viewport=t,this.depthTexture.magFilter=this.depthTexture.minFilter=Se,this.depthTexture.needsUpdate=!0;const e=new dn({vertexShader:$1,fragmentShader:Y1,glslVersion:zi,depthTest:!1,depthWrite:!1,uniforms:{picture:{value:null},part:{value:new Ee},upright:{value:!1}}});this.partMesh=new _t(this.quad,e),this.partMesh.frustumCulled=!1,this.partScene.add(this.partMesh);const i=new dn({vertexShader:K1,fragmentShader:Z1,glslVersion:zi,depthTest:!0,depthWrite:!0,uniforms:{picture:{value:null},depthMap:{value:this.depthTexture},toWorld:{value:new Yt},pictureEye:{value:new C},far:{value:10},flat_:{value:!0}}});this.surface=new _t(this.quad,i),this.surface.frustumCulled=!1,this.surface.renderOrder=-10,this.surface.visible=!1,t.scene.add(this.surface),t.beforeFrame.push(()=>this.updateSurface()),t.canvas.addEventListener("webglcontextlost",()=>{this.depthTexture.dispose(),this.target?.dispose()})}depth=new OS;depthTexture=new xf(this.depth.data,1,1,Yc,Nn);viewpoint=null;target=null;flatCamera=new Af;partMesh;partScene=new nh;surface;quad=new Vi(2,2);grid=new Vi(2,2,Jd,Jd);show(t,e,i,s){this.resizeTarget();const r=new je(e);r.flipY=!1,r.generateMipmaps=!1,r.minFilter=r.magFilter=tn,r.needsUpdate=!0,this.draw(r,t,!1),r.dispose(),e instanceof ImageBitmap&&e.close(),this.depth.addPart(t,i),this.uploadDepth(),this.viewpoint=s??this.viewpoint,this.surface.visible=!0,this.viewport.invalidate()}showOwn({width:t,height:e,values:i},s){this.resizeTarget();const{renderer:r}=this.viewport,o=r.getContext();r.setRenderTarget(this.target);const a=o.getParameter(o.FRAMEBUFFER_BINDING);s(a,this.target?.width??1,this.target?.height??1),r.resetState(),r.setRenderTarget(null),this.depth.replace(t,e,i),this.uploadDepth(),this.viewpoint={viewProjection:this.viewport.viewProjection,eye:this.viewport.camera.position.clone()},this.surface.visible=!0,this.updateSurface()}uploadDepth(){const{data:t,width:e,height:i}=this.depth,s=this.depthTexture.image;(s.width!==e||s.height!==i)&&this.depthTexture.dispose(),this.depthTexture.image={data:t,width:e,height:i},this.depthTexture.needsUpdate=!0}resizeTarget(){const{width:t,height:e}=this.viewport.pixels,i=this.target;i?.width===t&&i.height===e||(this.target=new En(t,e,{depthBuffer:!1,minFilter:Se,magFilter:Se,generateMipmaps:!1}),i&&(this.draw(i.texture,{x:0,y:0,width:1,height:1,full_width:1,full_height:1},!0),i.dispose()),this.surface.material.uniforms.picture.value=this.target.texture)}draw(t,e,i){const{renderer:s}=this.viewport,{uniforms:r}=this.partMesh.material;r.picture.value=t,r.upright.value=i,r.part.value.set(e.x/e.full_width,e.y/e.full_height,e.width/e.full_width,e.height/e.full_height),s.setRenderTarget(this.target),s.render(this.partScene,this.flatCamera),s.setRenderTarget(null)}updateSurface(){const{uniforms:t}=this.surface.material,e=this.viewport.viewProjection,i=this.viewpoint!==null&&!Q1(e,this.viewpoint.viewProjection);if(this.surface.geometry=i?this.grid:this.quad,this.surface.material.depthTest=this.surface.material.depthWrite=i,t.flat_.value=!i,!i||this.viewpoint===null)return;t.toWorld.value.copy(this.viewpoint.viewProjection).invert(),t.pictureEye.value.copy(this.viewpoint.eye);let s=0;for(const r of this.depth.data)r<Ii&&r>s&&(s=r);t.far.value=s>0?1.05*s:10}}function Q1(n,t){return n.elements.every((e,i)=>Math.abs(e-t.elements[i])<=1e-6*(1+Math.abs(e)))}const tp={type:"change"},Eh={type:"start"},Wm={type:"end"},Wo=new js,ep=new Vn,J1=Math.cos(70*pi.DEG2RAD),De=new C,rn=2*Math.PI,ee={NONE:-1,ROTATE:0,DOLLY:1,PAN:2,TOUCH_ROTATE:3,TOUCH_PAN:4,TOUCH_DOLLY_PAN:5,TOUCH_DOLLY_ROTATE:6},Al=1e-6;class tT extends Rf{constructor(t,e=null){super(t,e),this.state=ee.NONE,this.target=new C,this.cursor=new C,this.minDistance=0,this.maxDistance=1/0,this.minZoom=0,this.maxZoom=1/0,this.minTargetRadius=0,this.maxTargetRadius=1/0,this.minPolarAngle=0,this.maxPolarAngle=Math.PI,this.minAzimuthAngle=-1/0,this.maxAzimuthAngle=1/0,this.enableDamping=!1,this.dampingFactor=.05,this.enableZoom=!0,this.zoomSpeed=1,this.enableRotate=!0,this.rotateSpeed=1,this.keyRotateSpeed=1,this.enablePan=!0,this.panSpeed=1,this.screenSpacePanning=!0,this.keyPanSpeed=7,this.zoomToCursor=!1,this.autoRotate=!1,this.autoRotateSpeed=2,this.keys={LEFT:"ArrowLeft",UP:"ArrowUp",RIGHT:"ArrowRight",BOTTOM:"ArrowDown"},this.mouseButtons={LEFT:Is.ROTATE,MIDDLE:Is.DOLLY,RIGHT:Is.PAN},this.touches={ONE:Ps.ROTATE,TWO:Ps.DOLLY_PAN},this.target0=this.target.clone(),this.position0=this.object.position.clone(),this.zoom0=this.object.zoom,this._cursorStyle="auto",this._domElementKeyEvents=null,this._lastPosition=new C,this._lastQuaternion=new ce,this._lastTargetPosition=new C,this._quat=new ce().setFromUnitVectors(t.up,new C(0,1,0)),this._quatInverse=this._quat.clone().invert(),this._spherical=new Wu,this._sphericalDelta=new Wu,this._scale=1,this._panOffset=new C,this._rotateStart=new It,this._rotateEnd=new It,this._rotateDelta=new It,this._panStart=new It,this._panEnd=new It,this._panDelta=new It,this._dollyStart=new It,this._dollyEnd=new It,this._dollyDelta=new It,this._dollyDirection=new C,this._mouse=new It,this._performCursorZoom=!1,this._pointers=[],this._pointerPositions={},this._controlActive=!1,this._onPointerMove=nT.bind(this),this._onPointerDown=eT.bind(this),this._onPointerUp=iT.bind(this),this._onContextMenu=hT.bind(this),this._onMouseWheel=oT.bind(this),this._onKeyDown=aT.bind(this),this._onTouchStart=lT.bind(this),this._onTouchMove=cT.bind(this),this._onMouseDown=sT.bind(this),this._onMouseMove=rT.bind(this),this._interceptControlDown=uT.bind(this),this._interceptControlUp=dT.bind(this),this.domElement!==null&&this.connect(this.domElement),this.update()}set cursorStyle(t){this._cursorStyle=t,t==="grab"?this.domElement.style.cursor="grab":this.domElement.style.cursor="auto"}get cursorStyle(){return this._cursorStyle}connect(t){super.connect(t),this.domElement.addEventListener("pointerdown",this._onPointerDown),this.domElement.addEventListener("pointercancel",this._onPointerUp),this.domElement.addEventListener("contextmenu",this._onContextMenu),this.domElement.addEventListener("wheel",this._onMouseWheel,{passive:!1}),this.domElement.ownerDocument.addEventListener("keydown",this._interceptControlDown,{passive:!0,capture:!0}),this.domElement.style.touchAction="none"}disconnect(){this.state=ee.NONE,this.domElement.removeEventListener("pointerdown",this._onPointerDown),this.domElement.ownerDocument.removeEventListener("pointermove",this._onPointerMove),this.domElement.ownerDocument.removeEventListener("pointerup",this._onPointerUp),this.domElement.removeEventListener("pointercancel",this._onPointerUp),this.domElement.removeEventListener("wheel",this._onMouseWheel),this.domElement.removeEventListener("contextmenu",this._onContextMenu),this.stopListenToKeyEvents(),this.domElement.ownerDocument.removeEventListener("keydown",this._interceptControlDown,{capture:!0}),this.domElement.ownerDocument.removeEventListener("keyup",this._interceptControlUp,{capture:!0}),this._controlActive=!1,this._pointers.length=0,this._pointerPositions={},this.domElement.style.touchAction="",this.domElement.style.cursor="auto"}dispose(){this.disconnect()}getPolarAngle(){return this._spherical.phi}getAzimuthalAngle(){return this._spherical.theta}getDistance(){return this.object.position.distanceTo(this.target)}listenToKeyEvents(t){t.addEventListener("keydown",this._onKeyDown),this._domElementKeyEvents=t}stopListenToKeyEvents(){this._domElementKeyEvents!==null&&(this._domElementKeyEvents.removeEventListener("keydown",this._onKeyDown),this._domElementKeyEvents=null)}saveState(){this.target0.copy(this.target),this.position0.copy(this.object.position),this.zoom0=this.object.zoom}reset(){this.target.copy(this.target0),this.object.position.copy(this.position0),this.object.zoom=this.zoom0,this.object.updateProjectionMatrix(),this.dispatchEvent(tp),this.update(),this.state=ee.NONE}pan(t,e){this._pan(t,e),this.update()}dollyIn(t){this._dollyIn(t),this.update()}dollyOut(t){this._dollyOut(t),this.update()}rotateLeft(t){this._rotateLeft(t),this.update()}rotateUp(t){this._rotateUp(t),this.update()}update(t=null){const e=this.object.position;De.copy(e).sub(this.target),De.applyQuaternion(this._quat),this._spherical.setFromVector3(De),this.autoRotate&&this.state===ee.NONE&&this._rotateLeft(this._getAutoRotationAngle(t)),this.enableDamping?(this._spherical.theta+=this._sphericalDelta.theta*this.dampingFactor,this._spherical.phi+=this._sphericalDelta.phi*this.dampingFactor):(this._spherical.theta+=this._sphericalDelta.theta,this._spherical.phi+=this._sphericalDelta.phi);let i=this.minAzimuthAngle,s=this.maxAzimuthAngle;isFinite(i)&&isFinite(s)&&(i<-Math.PI?i+=rn:i>Math.PI&&(i-=rn),s<-Math.PI?s+=rn:s>Math.PI&&(s-=rn),i<=s?this._spherical.theta=Math.max(i,Math.min(s,this._spherical.theta)):this._spherical.theta=this._spherical.theta>(i+s)/2?Math.max(i,this._spherical.theta):Math.min(s,this._spherical.theta)),this._spherical.phi=Math.max(this.minPolarAngle,Math.min(this.maxPolarAngle,this._spherical.phi)),this._spherical.makeSafe(),this.enableDamping===!0?this.target.addScaledVector(this._panOffset,this.dampingFactor):this.target.add(this._panOffset),this.target.sub(this.cursor),this.target.clampLength(this.minTargetRadius,this.maxTargetRadius),this.target.add(this.cursor);let r=!1;if(this.zoomToCursor&&this._performCursorZoom||this.object.isOrthographicCamera)this._spherical.radius=this._clampDistance(this._spherical.radius);else{const o=this._spherical.radius;this._spherical.radius=this._clampDistance(this._spherical.radius*this._scale),r=o!=this._spherical.radius}if(De.setFromSpherical(this._spherical),De.applyQuaternion(this._quatInverse),e.copy(this.target).add(De),this.object.lookAt(this.target),this.enableDamping===!0?(this._sphericalDelta.theta*=1-this.dampingFactor,this._sphericalDelta.phi*=1-this.dampingFactor,this._panOffset.multiplyScalar(1-this.dampingFactor)):(this._sphericalDelta.set(0,0,0),this._panOffset.set(0,0,0)),this.zoomToCursor&&this._performCursorZoom){let o=null;if(this.object.isPerspectiveCamera){const a=De.length();o=this._clampDistance(a*this._scale);const l=a-o;this.object.position.addScaledVector(this._dollyDirection,l),this.object.updateMatrixWorld(),r=!!l}else if(this.object.isOrthographicCamera){const a=new C(this._mouse.x,this._mouse.y,0);a.unproject(this.object);const l=this.object.zoom;this.object.zoom=Math.max(this.minZoom,Math.min(this.maxZoom,this.object.zoom/this._scale)),this.object.updateProjectionMatrix(),r=l!==this.object.zoom;const c=new C(this._mouse.x,this._mouse.y,0);c.unproject(this.object),this.object.position.sub(c).add(a),this.object.updateMatrixWorld(),o=De.length()}else console.warn("WARNING: OrbitControls.js encountered an unknown camera type - zoom to cursor disabled."),this.zoomToCursor=!1;o!==null&&(this.screenSpacePanning?this.target.set(0,0,-1).transformDirection(this.object.matrix).multiplyScalar(o).add(this.object.position):(Wo.origin.copy(this.object.position),Wo.direction.set(0,0,-1).transformDirection(this.object.matrix),Math.abs(this.object.up.dot(Wo.direction))<J1?this.object.lookAt(this.target):(ep.setFromNormalAndCoplanarPoint(this.object.up,this.target),Wo.intersectPlane(ep,this.target))))}else if(this.object.isOrthographicCamera){const o=this.object.zoom;this.object.zoom=Math.max(this.minZoom,Math.min(this.maxZoom,this.object.zoom/this._scale)),o!==this.object.zoom&&(this.object.updateProjectionMatrix(),r=!0)}return this._scale=1,this._performCursorZoom=!1,r||this._lastPosition.distanceToSquared(this.object.position)>Al||8*(1-this._lastQuaternion.dot(this.object.quaternion))>Al||this._lastTargetPosition.distanceToSquared(this.target)>Al?(this.dispatchEvent(tp),this._lastPosition.copy(this.object.position),this._lastQuaternion.copy(this.object.quaternion),this._lastTargetPosition.copy(this.target),!0):!1}_getAutoRotationAngle(t){return t!==null?rn/60*this.autoRotateSpeed*t:rn/60/60*this.autoRotateSpeed}_getZoomScale(t){const e=Math.abs(t*.01);return Math.pow(.95,this.zoomSpeed*e)}_rotateLeft(t){this._sphericalDelta.theta-=t}_rotateUp(t){this._sphericalDelta.phi-=t}_panLeft(t,e){De.setFromMatrixColumn(e,0),De.multiplyScalar(-t),this._panOffset.add(De)}_panUp(t,e){this.screenSpacePanning===!0?De.setFromMatrixColumn(e,1):(De.setFromMatrixColumn(e,0),De.crossVectors(this.object.up,De)),De.multiplyScalar(t),this._panOffset.add(De)}_pan(t,e){const i=this.domElement;if(this.object.isPerspectiveCamera){const s=this.object.position;De.copy(s).sub(this.target);let r=De.length();r*=Math.tan(this.object.fov/2*Math.PI/180),this._panLeft(2*t*r/i.clientHeight,this.object.matrix),this._panUp(2*e*r/i.clientHeight,this.object.matrix)}else this.object.isOrthographicCamera?(this._panLeft(t*(this.object.right-this.object.left)/this.object.zoom/i.clientWidth,this.object.matrix),this._panUp(e*(this.object.top-this.object.bottom)/this.object.zoom/i.clientHeight,this.object.matrix)):(console.warn("WARNING: OrbitControls.js encountered an unknown camera type - pan disabled."),this.enablePan=!1)}_dollyOut(t){this.object.isPerspectiveCamera||this.object.isOrthographicCamera?this._scale/=t:(console.warn("WARNING: OrbitControls.js encountered an unknown camera type - dolly/zoom disabled."),this.enableZoom=!1)}_dollyIn(t){this.object.isPerspectiveCamera||this.object.isOrthographicCamera?this._scale*=t:(console.warn("WARNING: OrbitControls.js encountered an unknown camera type - dolly/zoom disabled."),this.enableZoom=!1)}_updateZoomParameters(t,e){if(!this.zoomToCursor)return;this._performCursorZoom=!0;const i=this.domElement.getBoundingClientRect(),s=t-i.left,r=e-i.top,o=i.width,a=i.height;this._mouse.x=s/o*2-1,this._mouse.y=-(r/a)*2+1,this._dollyDirection.set(this._mouse.x,this._mouse.y,1).unproject(this.object).sub(this.object.position).normalize()}_clampDistance(t){return Math.max(this.minDistance,Math.min(this.maxDistance,t))}_handleMouseDownRotate(t){this._rotateStart.set(t.clientX,t.clientY)}_handleMouseDownDolly(t){this._updateZoomParameters(t.clientX,t.clientY),this._dollyStart.set(t.clientX,t.clientY)}_handleMouseDownPan(t){this._panStart.set(t.clientX,t.clientY)}_handleMouseMoveRotate(t){this._rotateEnd.set(t.clientX,t.clientY),this._rotateDelta.subVectors(this._rotateEnd,this._rotateStart).multiplyScalar(this.rotateSpeed);const e=this.domElement;this._rotateLeft(rn*this._rotateDelta.x/e.clientHeight),this._rotateUp(rn*this._rotateDelta.y/e.clientHeight),this._rotateStart.copy(this._rotateEnd),this.update()}_handleMouseMoveDolly(t){this._dollyEnd.set(t.clientX,t.clientY),this._dollyDelta.subVectors(this._dollyEnd,this._dollyStart),this._dollyDelta.y>0?this._dollyOut(this._getZoomScale(this._dollyDelta.y)):this._dollyDelta.y<0&&this._dollyIn(this._getZoomScale(this._dollyDelta.y)),this._dollyStart.copy(this._dollyEnd),this.zoomToCursor&&(this._performCursorZoom=!0,this._dollyDirection.set(this._mouse.x,this._mouse.y,1).unproject(this.object).sub(this.object.position).normalize()),this.update()}_handleMouseMovePan(t){this._panEnd.set(t.clientX,t.clientY),this._panDelta.subVectors(this._panEnd,this._panStart).multiplyScalar(this.panSpeed),this._pan(this._panDelta.x,this._panDelta.y),this._panStart.copy(this._panEnd),this.update()}_handleMouseWheel(t){this._updateZoomParameters(t.clientX,t.clientY),t.deltaY<0?this._dollyIn(this._getZoomScale(t.deltaY)):t.deltaY>0&&this._dollyOut(this._getZoomScale(t.deltaY)),this.update()}_handleKeyDown(t){let e=!1;switch(t.code){case this.keys.UP:t.ctrlKey||t.metaKey||t.shiftKey?this.enableRotate&&this._rotateUp(rn*this.keyRotateSpeed/this.domElement.clientHeight):this.enablePan&&this._pan(0,this.keyPanSpeed),e=!0;break;case this.keys.BOTTOM:t.ctrlKey||t.metaKey||t.shiftKey?this.enableRotate&&this._rotateUp(-rn*this.keyRotateSpeed/this.domElement.clientHeight):this.enablePan&&this._pan(0,-this.keyPanSpeed),e=!0;break;case this.keys.LEFT:t.ctrlKey||t.metaKey||t.shiftKey?this.enableRotate&&this._rotateLeft(rn*this.keyRotateSpeed/this.domElement.clientHeight):this.enablePan&&this._pan(this.keyPanSpeed,0),e=!0;break;case this.keys.RIGHT:t.ctrlKey||t.metaKey||t.shiftKey?this.enableRotate&&this._rotateLeft(-rn*this.keyRotateSpeed/this.domElement.clientHeight):this.enablePan&&this._pan(-this.keyPanSpeed,0),e=!0;break}e&&(t.preventDefault(),this.update())}_handleTouchStartRotate(t){if(this._pointers.length===1)this._rotateStart.set(t.pageX,t.pageY);else{const e=this._getSecondPointerPosition(t),i=.5*(t.pageX+e.x),s=.5*(t.pageY+e.y);this._rotateStart.set(i,s)}}_handleTouchStartPan(t){if(this._pointers.length===1)this._panStart.set(t.pageX,t.pageY);else{const e=this._getSecondPointerPosition(t),i=.5*(t.pageX+e.x),s=.5*(t.pageY+e.y);this._panStart.set(i,s)}}_handleTouchStartDolly(t){const e=this._getSecondPointerPosition(t),i=t.pageX-e.x,s=t.pageY-e.y,r=Math.sqrt(i*i+s*s);this._dollyStart.set(0,r)}_handleTouchStartDollyPan(t){this.enableZoom&&this._handleTouchStartDolly(t),this.enablePan&&this._handleTouchStartPan(t)}_handleTouchStartDollyRotate(t){this.enableZoom&&this._handleTouchStartDolly(t),this.enableRotate&&this._handleTouchStartRotate(t)}_handleTouchMoveRotate(t){if(this._pointers.length==1)this._rotateEnd.set(t.pageX,t.pageY);else{const i=this._getSecondPointerPosition(t),s=.5*(t.pageX+i.x),r=.5*(t.pageY+i.y);this._rotateEnd.set(s,r)}this._rotateDelta.subVectors(this._rotateEnd,this._rotateStart).multiplyScalar(this.rotateSpeed);const e=this.domElement;this._rotateLeft(rn*this._rotateDelta.x/e.clientHeight),this._rotateUp(rn*this._rotateDelta.y/e.clientHeight),this._rotateStart.copy(this._rotateEnd)}_handleTouchMovePan(t){if(this._pointers.length===1)this._panEnd.set(t.pageX,t.pageY);else{const e=this._getSecondPointerPosition(t),i=.5*(t.pageX+e.x),s=.5*(t.pageY+e.y);this._panEnd.set(i,s)}this._panDelta.subVectors(this._panEnd,this._panStart).multiplyScalar(this.panSpeed),this._pan(this._panDelta.x,this._panDelta.y),this._panStart.copy(this._panEnd)}_handleTouchMoveDolly(t){const e=this._getSecondPointerPosition(t),i=t.pageX-e.x,s=t.pageY-e.y,r=Math.sqrt(i*i+s*s);this._dollyEnd.set(0,r),this._dollyDelta.set(0,Math.pow(this._dollyEnd.y/this._dollyStart.y,this.zoomSpeed)),this._dollyOut(this._dollyDelta.y),this._dollyStart.copy(this._dollyEnd);const o=(t.pageX+e.x)*.5,a=(t.pageY+e.y)*.5;this._updateZoomParameters(o,a)}_handleTouchMoveDollyPan(t){this.enableZoom&&this._handleTouchMoveDolly(t),this.enablePan&&this._handleTouchMovePan(t)}_handleTouchMoveDollyRotate(t){this.enableZoom&&this._handleTouchMoveDolly(t),this.enableRotate&&this._handleTouchMoveRotate(t)}_addPointer(t){this._pointers.push(t.pointerId)}_removePointer(t){delete this._pointerPositions[t.pointerId];for(let e=0;e<this._pointers.length;e++)if(this._pointers[e]==t.pointerId){this._pointers.splice(e,1);return}}_isTrackingPointer(t){for(let e=0;e<this._pointers.length;e++)if(this._pointers[e]==t.pointerId)return!0;return!1}_trackPointer(t){let e=this._pointerPositions[t.pointerId];e===void 0&&(e=new It,this._pointerPositions[t.pointerId]=e),e.set(t.pageX,t.pageY)}_getSecondPointerPosition(t){const e=t.pointerId===this._pointers[0]?this._pointers[1]:this._pointers[0];return this._pointerPositions[e]}_customWheelEvent(t){const e=t.deltaMode,i={clientX:t.clientX,clientY:t.clientY,deltaY:t.deltaY};switch(e){case 1:i.deltaY*=16;break;case 2:i.deltaY*=100;break}return t.ctrlKey&&!this._controlActive&&(i.deltaY*=10),i}}function eT(n){this.enabled!==!1&&(this._pointers.length===0&&(this.domElement.setPointerCapture(n.pointerId),this.domElement.ownerDocument.addEventListener("pointermove",this._onPointerMove),this.domElement.ownerDocument.addEventListener("pointerup",this._onPointerUp)),!this._isTrackingPointer(n)&&(this._addPointer(n),n.pointerType==="touch"?this._onTouchStart(n):this._onMouseDown(n),this._cursorStyle==="grab"&&(this.domElement.style.cursor="grabbing")))}function nT(n){this.enabled!==!1&&(n.pointerType==="touch"?this._onTouchMove(n):this._onMouseMove(n))}function iT(n){switch(this._removePointer(n),this._pointers.length){case 0:this.domElement.releasePointerCapture(n.pointerId),this.domElement.ownerDocument.removeEventListener("pointermove",this._onPointerMove),this.domElement.ownerDocument.removeEventListener("pointerup",this._onPointerUp),this.dispatchEvent(Wm),this.state=ee.NONE,this._cursorStyle==="grab"&&(this.domElement.style.cursor="grab");break;case 1:const t=this._pointers[0],e=this._pointerPositions[t];this._onTouchStart({pointerId:t,pageX:e.x,pageY:e.y});break}}function sT(n){let t;switch(n.button){case 0:t=this.mouseButtons.LEFT;break;case 1:t=this.mouseButtons.MIDDLE;break;case 2:t=this.mouseButtons.RIGHT;break;default:t=-1}switch(t){case Is.DOLLY:if(this.enableZoom===!1)return;this._handleMouseDownDolly(n),this.state=ee.DOLLY;break;case Is.ROTATE:if(n.ctrlKey||n.metaKey||n.shiftKey){if(this.enablePan===!1)return;this._handleMouseDownPan(n),this.state=ee.PAN}else{if(this.enableRotate===!1)return;this._handleMouseDownRotate(n),this.state=ee.ROTATE}break;case Is.PAN:if(n.ctrlKey||n.metaKey||n.shiftKey){if(this.enableRotate===!1)return;this._handleMouseDownRotate(n),this.state=ee.ROTATE}else{if(this.enablePan===!1)return;this._handleMouseDownPan(n),this.state=ee.PAN}break;default:this.state=ee.NONE}this.state!==ee.NONE&&this.dispatchEvent(Eh)}function rT(n){switch(this.state){case ee.ROTATE:if(this.enableRotate===!1)return;this._handleMouseMoveRotate(n);break;case ee.DOLLY:if(this.enableZoom===!1)return;this._handleMouseMoveDolly(n);break;case ee.PAN:if(this.enablePan===!1)return;this._handleMouseMovePan(n);break}}function oT(n){this.enabled===!1||this.enableZoom===!1||this.state!==ee.NONE||(n.preventDefault(),this.dispatchEvent(Eh),this._handleMouseWheel(this._customWheelEvent(n)),this.dispatchEvent(Wm))}function aT(n){this.enabled!==!1&&this._handleKeyDown(n)}function lT(n){switch(this._trackPointer(n),this._pointers.length){case 1:switch(this.touches.ONE){case Ps.ROTATE:if(this.enableRotate===!1){this.state=ee.NONE;break}this._handleTouchStartRotate(n),this.state=ee.TOUCH_ROTATE;break;case Ps.PAN:if(this.enablePan===!1){this.state=ee.NONE;break}this._handleTouchStartPan(n),this.state=ee.TOUCH_PAN;break;default:this.state=ee.NONE}break;case 2:switch(this.touches.TWO){case Ps.DOLLY_PAN:if(this.enableZoom===!1&&this.enablePan===!1)return;this._handleTouchStartDollyPan(n),this.state=ee.TOUCH_DOLLY_PAN;break;case Ps.DOLLY_ROTATE:if(this.enableZoom===!1&&this.enableRotate===!1)return;this._handleTouchStartDollyRotate(n),this.state=ee.TOUCH_DOLLY_ROTATE;break;default:this.state=ee.NONE}break;default:this.state=ee.NONE}this.state!==ee.NONE&&this.dispatchEvent(Eh)}function cT(n){switch(this._trackPointer(n),this.state){case ee.TOUCH_ROTATE:if(this.enableRotate===!1)return;this._handleTouchMoveRotate(n),this.update();break;case ee.TOUCH_PAN:if(this.enablePan===!1)return;this._handleTouchMovePan(n),this.update();break;case ee.TOUCH_DOLLY_PAN:if(this.enableZoom===!1&&this.enablePan===!1)return;this._handleTouchMoveDollyPan(n),this.update();break;case ee.TOUCH_DOLLY_ROTATE:if(this.enableZoom===!1&&this.enableRotate===!1)return;this._handleTouchMoveDollyRotate(n),this.update();break;default:this.state=ee.NONE}}function hT(n){this.enabled!==!1&&n.preventDefault()}function uT(n){n.key==="Control"&&(this._controlActive=!0,this.domElement.ownerDocument.addEventListener("keyup",this._interceptControlUp,{passive:!0,capture:!0}))}function dT(n){n.key==="Control"&&(this._controlActive=!1,this.domElement.ownerDocument.removeEventListener("keyup",this._interceptControlUp,{passive:!0,capture:!0}))}class pT{constructor(t){this.redraw=t}scheduled=!1;deferred;request(){this.scheduled||(this.scheduled=!0,clearTimeout(this.deferred),this.deferred=void 0,requestAnimationFrame(t=>{this.scheduled=!1,this.redraw(t)}))}requestWithin(t){this.scheduled||(this.deferred??=setTimeout(()=>this.request(),t))}}const fT=2,mT=100;function gT(){const n=document.createElement("canvas").getContext("webgl2"),t=n?.getExtension("WEBGL_debug_renderer_info");if(!n||!t)return!1;const e=String(n.getParameter(t.UNMASKED_RENDERER_WEBGL));return n.getExtension("WEBGL_lose_context")?.loseContext(),/swiftshader|llvmpipe|software/i.test(e)}function vT(n){const t=document.createElement("canvas"),e=t.getContext("webgl2",{alpha:!1,depth:!0,stencil:!1,antialias:n,powerPreference:"high-performance"});return new Ny({canvas:t,context:e??void 0})}class _T{constructor(t){this.host=t;const{renderer:e}=this;e.setClearColor(1382170,1),e.autoClear=!1,e.info.autoReset=!0,t.append(e.domElement),new ResizeObserver(()=>this.resize()).observe(t),this.resize()}software=gT();renderer=vT(!this.software);scene=new nh;camera=new Pn(50,1,.01,1e3);orbit=null;beforeFrame=[];afterFrame=[];frameTime=16;cameraChanges=[];userTurns=[];orbitGuessed=[];sceneCenter=[0,0,0];redraws=new pT(t=>this.redraw(t));size=new It(1,1);get canvas(){return this.renderer.domElement}get pixels(){const{width:t,height:e}=this.canvas;return{width:t,height:e}}get points(){return{width:this.size.x,height:this.size.y}}invalidate(t=0){t>0?this.redraws.requestWithin(t):this.redraws.request()}drawUnseen(){const{renderer:t}=this;t.setRenderTarget(null),t.setScissor(0,0,1,1),t.setScissorTest(!0),t.render(this.scene,this.camera),t.setScissorTest(!1)}lookFrom(t,e,i,s){this.notifyUserTurn();const{camera:r}=this;(this.orbit===null||r.up.distanceTo(new C(...i))>1e-6)&&(r.up.set(...i),this.orbit?.dispose(),this.orbit=new tT(r,this.canvas),this.orbit.zoomToCursor=!0,this.orbit.addEventListener("start",()=>this.notifyUserTurn()),this.orbit.addEventListener("change",()=>this.updateCamera())),this.setPose(t,e),this.sceneCenter=s,this.resetOrbit(),this.orbit.update()}turnUp(t){this.orbit===null||this.camera.up.distanceTo(new C(...t))<=1e-6||this.lookFrom(this.c2w,this.camera.fov,t,this.sceneCenter)}pose(t,e){this.setPose(t,e),this.updateCamera()}resetOrbit(){if(this.orbit===null)return;const t=new C(...this.sceneCenter).sub(this.camera.position);this.orbitAt(Math.max(t.dot(this.forward),.1)),this.updateCamera();for(const e of this.orbitGuessed)e()}orbitAt(t){this.orbit?.target.copy(this.camera.position).addScaledVector(this.forward,t)}focus(t,e){if(this.orbit===null)return;this.notifyUserTurn();const i=this.camera.position.clone().sub(this.orbit.target).normalize(),s=Math.min(1,this.camera.aspect)*Math.tan(pi.degToRad(this.camera.fov/2));this.orbit.target.set(...t),this.camera.position.copy(this.orbit.target).addScaledVector(i,1.6*e/s),this.orbit.update(),this.updateCamera()}get c2w(){return this.camera.updateMatrixWorld(),this.camera.matrixWorld.clone().transpose().toArray()}get viewProjection(){return this.camera.updateMatrixWorld(),this.camera.projectionMatrix.clone().multiply(this.camera.matrixWorldInverse)}project=t=>{this.camera.updateMatrixWorld();const e=new C(...t).applyMatrix4(this.camera.matrixWorldInverse),i=-e.z,s=e.applyMatrix4(this.camera.projectionMatrix);return{x:(.5+.5*s.x)*this.size.x,y:(.5-.5*s.y)*this.size.y,depth:i}};device(t,e){return{x:2*t/this.size.x-1,y:1-2*e/this.size.y}}ray(t,e){this.camera.updateMatrixWorld();const i=this.device(t,e),s=new C(i.x,i.y,.5).unproject(this.camera);return new js(this.camera.position.clone(),s.sub(this.camera.position).normalize())}get forward(){return new C(0,0,-1).applyQuaternion(this.camera.getWorldQuaternion(new ce))}redraw(t){for(const e of this.beforeFrame)e();this.renderer.setRenderTarget(null),this.renderer.clear(),this.renderer.render(this.scene,this.camera),requestAnimationFrame(e=>{this.frameTime+=.2*(Math.min(e-t,mT)-this.frameTime);for(const i of this.afterFrame)i(e)})}setPose(t,e){const i=new Yt().fromArray([...t]).transpose();this.camera.fov=e,this.camera.position.setFromMatrixPosition(i),this.camera.quaternion.setFromRotationMatrix(i)}notifyUserTurn(){for(const t of this.userTurns)t()}updateCamera(){this.camera.updateProjectionMatrix(),this.camera.updateMatrixWorld();for(const t of this.cameraChanges)t();this.invalidate()}resize(){const{clientWidth:t,clientHeight:e}=this.host;t===0||e===0||(this.size.set(t,e),this.renderer.setPixelRatio(Math.min(devicePixelRatio,fT)),this.renderer.setSize(t,e),this.camera.aspect=t/e,this.updateCamera())}}const np=250,xT=4e3;class bT{constructor(t,e){this.open=t,this.handlers=e,this.connect()}socket=null;wait=np;send(t){return this.socket?.readyState!==1?!1:(this.socket.send(JSON.stringify(t)),!0)}connect(){const t=this.open();this.socket=t,t.binaryType="arraybuffer",t.onopen=()=>{this.wait=np,this.handlers.opened()},t.onmessage=({data:e})=>{typeof e=="string"?this.handlers.message(JSON.parse(e)):this.handlers.binary(e)},t.onclose=()=>{this.socket=null,this.handlers.lost(this.wait),setTimeout(()=>this.connect(),this.wait),this.wait=Math.min(2*this.wait,xT)}}}function wT(n){const t=new URL("socket",n.href);return t.protocol=n.protocol==="https:"?"wss:":"ws:",t.search=n.search,t.hash="",t.href}function Mh(n){return n.what==="splats"||n.what==="page"}function Xm(n,t){const e=t?n:n.slice(0,-1);return n.length<2?0:e.reduce((i,s)=>i+s.seconds,0)}function yT(n,t){const e=pi.clamp(t,0,1)*(n.length-1),i=Math.min(Math.floor(e),n.length-2),[s,r]=n.slice(i),o=e-i,a=[s,r].map(({c2w:p})=>new Yt().fromArray(p).transpose()),[l,c]=a.map(p=>new C().setFromMatrixPosition(p)),[h,d]=a.map(p=>new ce().setFromRotationMatrix(p));return{c2w:new Yt().compose(l.lerp(c,o),h.slerp(d,o),new C(1,1,1)).transpose().toArray(),fov_y_deg:pi.lerp(s.fov_y_deg,r.fov_y_deg,o)}}function ST(n,t){const e=pi.clamp(t,0,1)*(n.length-1),i=Math.min(Math.floor(e),n.length-2),[s,r]=n.slice(i);return s===null||r===null?null:s.map((o,a)=>pi.lerp(o,r[a],e-i))}class ET{constructor(t,e=()=>performance.now()){this.app=t,this.now=e,t.viewport.beforeFrame.unshift(()=>this.frame()),t.viewport.userTurns.push(()=>this.stop()),t.store.watch(["connection"],({connection:i})=>{i==="lost"&&this.stop()})}changed=()=>{};plays=0;expected=null;run=null;get playing(){return this.run!==null||this.expected!==null}toggle(){this.playing?this.stop():this.begin()}stop(){if(!this.playing)return;const{run:t}=this;this.run=this.expected=null,t!==null&&(this.app.send({type:"play_end",play:t.play}),this.app.viewport.resetOrbit()),this.changed(!1)}placeOf(t){if(this.run===null)return null;const e=this.run.tracks.get(t.id);return e===void 0?t.hidden?null:t.position:ST(e,this.run.share)}takePreview({page:t,play:e,on:i}){!i&&t===this.app.store.now.hello?.page&&e===this.run?.play&&this.stop()}async begin(){const t=++this.plays;this.expected=t,this.changed(!0);const e=await this.app.ask({what:"path"});if(this.expected!==t)return;const{state:i}=this.app.store.now;if(e===null||i===null||!this.app.send({type:"play_begin",play:t})){this.stop();return}this.expected=null;const{keys:s,loop:r}=i;this.run={play:t,stills:e.stills,tracks:new Map(e.tracks.map(({hotspot:o,places:a})=>[o,a])),share:0,duration:Xm(s,r),loop:r,started:null},this.app.viewport.invalidate()}frame(){const{run:t}=this;if(t===null)return;t.started??=this.now();const e=(this.now()-t.started)/1e3,i=t.loop?e%t.duration:Math.min(e,t.duration);t.share=i/t.duration;const{c2w:s,fov_y_deg:r}=yT(t.stills,t.share);this.app.send({type:"play",play:t.play,seconds:i}),this.app.viewport.pose(s,r),!t.loop&&e>=t.duration?this.stop():this.app.viewport.invalidate()}}const MT=["state","mode","tool","axes","cage","corners","hover","selecting","measured","placesHotspot","picked","cages","grid","view","before","split","connection","preview"],TT=1.5,AT=150,CT=300;class RT{store=new rS(wS());viewport;pictures;gizmo;camera;player;frames;page;drag=null;lines;handles;highlight;connection;grid;questions=new Map;requests=0;drags=0;lastEditId=null;constructor(t){this.viewport=new _T(t),this.pictures=new j1(this.viewport),this.lines=new BS(this.viewport,this.pictures),this.handles=new NE(this.viewport),this.highlight=new LE(this.viewport,this.pictures),this.gizmo=new yE(this.viewport.scene,this.viewport.camera);const{store:e,viewport:i,pictures:s}=this,r=h=>this.send(h),o=(h,d)=>this.say(h,d),a=this.camera=new WE(i,r);this.grid=new EE(h=>this.ask({what:"grid",edit:h}),()=>i.invalidate()),this.player=new ET(this),this.frames=new QE({store:e,viewport:i,pictures:s,camera:a,send:r,say:o,isDragging:()=>this.drag!==null,recordServerFrame:h=>this.page.recordServerFrame(h),supersedes:h=>this.page.supersedes(h)});const l=i.renderer.getContext(),c=VE(navigator.deviceMemory);this.page=new q1({store:e,viewport:i,pictures:s,camera:a,frames:this.frames,send:r,say:o},X1(location.search),h=>D1(h,l,c)),a.drawnHere=()=>this.page.draws,i.beforeFrame.push(()=>this.arrange()),i.beforeFrame.push(()=>this.frames.requestNext()),e.listen((h,d)=>{(h.view!==d.view||h.before!==d.before||h.split!==d.split)&&this.sendView(),MT.some(u=>h[u]!==d[u])&&i.invalidate()}),this.connection=new bT(()=>new WebSocket(wT(location)),{opened:()=>e.set({connection:"open"}),lost:()=>this.handleLoss(),message:h=>this.take(h),binary:h=>this.takeBinary(h)})}send(t){return aS(this.store.now,t)?this.connection.send(t):(this.say(Kr,"warning"),!1)}ask(t){const e=++this.requests;return new Promise(i=>{this.send({type:"ask",request:e,...t})?this.questions.set(e,i):i(null)})}say(t,e="info"){this.store.set({notice:{type:"notice",level:e,text:t}})}beginDrag(t=ui(this.store.now)){const e=xe(this.store.now);if(e===null||this.store.now.connection!=="open")return null;const i=Ur(this.store.now,e);return i!==null?(this.say(i,"warning"),null):(this.drags+=1,this.drag=new iS(this.drags,e,t,s=>this.send(s)),this.store.set({limit:null}),this.drag)}moveDrag(t,e){this.drag!==null&&(this.drag.move(t),this.frames.latency.addMove(this.drag.id,this.drag.seq,e),this.store.set({limit:this.drag.why}),this.redrawLines())}redrawLines(){const{viewport:t,page:e,frames:i}=this,s=t.software&&!e.draws&&i.latency.lastMove<CT;t.invalidate(s?AT:0)}endDrag(){this.drag?.end(),this.viewport.invalidate()}cancelDrag(){this.drag?.cancel(),this.dropDrag()}dropDrag(){this.drag=null,this.store.set({limit:null}),this.viewport.invalidate()}expectEdit(){this.lastEditId=Math.max(0,...this.store.now.state?.edits.map(t=>t.id)??[])}get gizmoPosition(){const{now:t}=this.store,e=xe(t);return e===null||t.corners.length===0?null:new C(...Yr(Dn(ai(e,this.drag),ui(t)),t.corners))}arrange(){const{now:t}=this.store,e=xe(t),i=this.viewport.camera.position.toArray(),r=(t.grid&&e!==null?this.grid.linesFor(e,mm(e,this.drag)):[]).map(u=>u.map(p=>ea(e?.carrier??null,p))),{segments:o,dots:a}=tE(t,this.drag,r,i,this.viewport.forward.toArray());this.lines.set(o),this.handles.set(a);const{selection:l}=t.state??{selection:null};this.highlight.draw(l!==null&&this.drag===null&&t.preview===null&&!t.before);const c=t.tool!=="select"||t.corners.length>0;if(!(e!==null&&Ur(t,e)===null&&t.selecting===null&&!Nr(t))||!_a(t)||!c){this.gizmo.hide();return}const d=Dn(ai(e,this.drag),ui(t));this.gizmo.dragging?this.gizmo.moveTo(this.gizmoPosition??new C(...d.pivot)):this.gizmo.show(t.tool,t.axes,d,this.gizmoPosition,IS(e.carrier)),this.gizmo.compile(()=>this.viewport.drawUnseen())}shownCages(t){return ai(t,this.drag)}take(t){switch(t.type){case"hello":this.takeHello(t);break;case"state":this.takeState(t);break;case"dragged":this.drag?.takeAnswer(t)&&this.viewport.invalidate(),this.drag?.id===t.drag&&!this.drag.ended&&this.takeCarriers(t.carried),this.drag&&!this.drag.ended&&this.store.set({limit:this.drag.why});break;case"drag_over":this.drag?.id===t.drag&&this.dropDrag();break;case"answer":this.questions.get(t.request)?.(t.failed?null:t),this.questions.delete(t.request);break;case"notice":this.store.set({notice:t});break;case"preview":this.takePreview(t);break;case"preparing":this.store.set({preparing:t});break;case"job":this.takeJob(t);break}}takeHello(t){const e=this.store.now.hello,i=e!==null&&e.scene!==t.scene;if(this.store.set(i?{hello:t,state:null,corners:[],hover:null,jobs:[]}:{hello:t}),this.lines.slack=TT*t.voxel,e===null||i){const[s,r]=t.bounds,o=s.map((l,c)=>.5*(l+r[c])),a=(i?null:yS())??t.start.c2w;this.viewport.lookFrom(a,t.start.fov_y_deg,t.up,o)}this.camera.restate(),this.sendView()}takeState(t){const{lastEditId:e}=this;this.frames.lastNews=performance.now();const i=e!==null&&t.edits.some(l=>l.id>e);this.drag?.ended&&(this.drag=null,this.store.set({limit:null}));const s=t.selected!==this.store.now.state?.selected,r=xe(this.store.now),o=t.edits.find(l=>l.id===t.selected),a=r?.points?.deformed.length!==o?.points?.deformed.length;if(this.store.set({state:t,...s||a?{corners:[],hover:null}:{}}),this.viewport.turnUp(La(this.store.now)),i){this.lastEditId=null;const l=xe(this.store.now)?.cage!=="box";this.store.set({mode:l?"edit":"set",cage:"inner"})}}takeCarriers(t){const{state:e}=this.store.now;e===null||t.length===0||(this.store.set({state:NS(e,t)}),this.viewport.invalidate())}takeJob(t){if(this.store.set({jobs:[...this.store.now.jobs.filter(i=>i.job!==t.job),t]}),!Mh(t)||t.state!=="done"||t.page!==this.store.now.hello?.page)return;const e=document.createElement("a");e.href=`exports/${t.job}/${encodeURIComponent(t.out)}${location.search}`,e.download=t.out,e.click()}takePreview(t){const{preview:e}=this.store.now;t.on?this.store.set({preview:t}):e?.page===t.page&&e.play===t.play&&this.store.set({preview:null}),this.player.takePreview(t)}takeBinary(t){const{header:e,start:i}=qE(t);e.type==="highlight"?this.highlight.take(e,t.slice(i)):e.type==="edits"?this.page.takeEdits(e,t.slice(i)):this.frames.take(t,e,i)}handleLoss(){const t=this.drag!==null;this.drag=null;for(const e of this.questions.values())e(null);this.questions.clear(),this.grid.clear(),this.store.set({connection:"lost",limit:null,preview:null}),t&&this.say("the connection was lost during a drag; the drag is undone","warning"),this.viewport.invalidate()}sendView(){const{view:t,before:e,split:i}=this.store.now;this.send({type:"display",view:t,before:e,split:i})}}function PT(n){const{viewport:t}=n,e=(i,s)=>{const r=t.canvas.getBoundingClientRect();return{x:r.left+i,y:r.top+s}};return{get now(){return n.store.now},get picture(){return n.frames.last},latency:n.frames.latency,get page(){const{drawn:i,why:s,draws:r,here:o,scene:a,uploaded:l,location:c}=n.page;return{drawn:i,why:s,draws:r,here:o,loads:a.loads,uploaded:{...l},rates:c.summary}},get camera(){return{c2w:t.c2w,seq:n.camera.seq}},get highlighted(){return n.highlight.shown},get drag(){if(n.drag===null)return null;const{id:i,seq:s,ended:r,why:o,followed:a}=n.drag;return{id:i,seq:s,ended:r,why:o,followed:a}},get settled(){const i=n.frames.last,{state:s,view:r,before:o,split:a,preview:l}=n.store.now;if(n.drag!==null||l!==null||i===null||s===null||!n.camera.resting)return!1;const c=i.camera===n.camera.seq&&i.revision>=s.pictured&&i.drag===0;return i.final&&c&&i.view===r&&i.before===o&&i.split===a},get quiet(){return performance.now()-n.frames.lastNews},screen(i,s,r,o="deformed"){const a=n.store.now.state?.edits.find(d=>d.id===i),l=a&&n.shownCages(a)[o];if(!l)throw new Error(`edit ${i} has no ${o} cage`);const{x:c,y:h}=t.project(Yr(s==="point"?l:{...l,points:void 0},ga({kind:s,index:r})));return e(c,h)},grip(i){n.arrange();const{width:s,height:r}=t.points,o=d=>[(.5+.5*d.x)*s,(.5-.5*d.y)*r],a=xe(n.store.now),l=a===null?[]:mh(n.store.now,n.shownCages(a)),c={x:4/s,y:4/r},h=n.gizmo.grip(i,c,d=>l.every(({posed:u})=>cm(...o(d),u,t.project)===null));return h&&e(...o(h))},project(i){const{x:s,y:r}=t.project(i);return e(s,r)},depth(i,s){const r=t.canvas.getBoundingClientRect();return n.pictures.depth.at((i-r.left)/r.width,(s-r.top)/r.height)}}}const LT=["Escape","Ctrl+C","Shift+M","?"];function DT(n,t,e,i,s){return[{group:"Tools",keys:["1","G"],action:"Move",run:()=>t.setTool("translate")},{group:"Tools",keys:["2","R"],action:"Rotate",run:()=>t.setTool("rotate")},{group:"Tools",keys:["3","S"],action:"Scale",run:()=>t.setTool("scale")},{group:"Tools",keys:["4","Q"],action:"Select: no gizmo",run:()=>t.setTool("select")},{group:"Tools",keys:["Tab"],action:"Set mode or Edit mode",run:()=>t.toggleMode()},{group:"Tools",keys:["W"],action:"World axes or cage axes",run:()=>t.toggleAxes()},{group:"Tools",keys:["Escape"],action:"Cancel the drag; clear the selection",run:()=>t.escape(()=>i.cancel()||e.cancel())},{group:"Cages",keys:["C"],action:"Set mode: inner cage, outer cage, both",run:()=>t.nextCage()},{group:"Cages",keys:["I"],action:"Fit the inner cage to the dense part of its content",run:()=>t.fitInner()},{group:"Cages",keys:["O"],action:"Proportional editing: control points around the dragged ones go along; also while dragging",run:()=>t.toggleProportional(!0)},{group:"Cages",keys:["Alt+O"],action:"Connected only: control points reach through dense matter alone",run:()=>t.toggleConnected()},{group:"Tools",keys:["Shift+M"],action:"Measure between two points; sets the scene's scale in meters",run:()=>t.toggleMeasuring()},{group:"Tools",keys:["Shift+Y"],action:"Up direction by three points of something level",run:()=>t.togglePicking("up")},{group:"Edits",keys:["Shift+A"],action:"Align a paste by three pairs of points",run:()=>t.togglePicking("paste")},{group:"Scene",keys:["Shift+H"],action:"Place hotspots: points with a title and text, for exported pages",run:()=>t.toggleHotspots()},{group:"Selection",keys:["M"],action:"Brush: paint over elements; [ and ] change its size",run:()=>t.toggleSelecting("brush")},{group:"Selection",keys:["J"],action:"Lasso",run:()=>t.toggleSelecting("lasso")},{group:"Selection",keys:["A"],action:"Select all",run:()=>t.changeSelection("all")},{group:"Selection",keys:["Alt+A"],action:"Select none",run:()=>t.changeSelection("none")},{group:"Selection",keys:["Ctrl+I"],action:"Invert the selection",run:()=>t.changeSelection("invert")},{group:"Selection",keys:["Ctrl++","Ctrl+="],action:"Grow the selection",run:()=>t.changeSelection("grow")},{group:"Selection",keys:["Ctrl+-"],action:"Shrink the selection",run:()=>t.changeSelection("shrink")},{group:"Selection",keys:["E"],action:"Enclose the selection in a new cage: a box",run:()=>t.encloseSelection()},{group:"Selection",keys:["Shift+E"],action:"Enclose it in a lattice of control points",run:()=>t.encloseSelection("lattice")},{group:"Selection",keys:["Alt+E"],action:"Enclose it in a closed mesh",run:()=>t.encloseSelection("mesh")},{group:"Selection",keys:["Ctrl+Delete"],action:"Delete the selected elements",run:()=>t.removeElements()},{group:"Selection",keys:["/"],action:"Isolate the selection, or show everything again",run:()=>t.toggleIsolated()},{group:"Edits",keys:["D"],action:"Discrete or continuous",run:()=>t.toggleKind()},{group:"Edits",keys:["U"],action:"Fill what is uncovered, or leave it",run:()=>t.toggleFill()},{group:"Edits",keys:["Shift+U"],action:"Shadows go along, or stay",run:()=>t.toggleShadows()},{group:"Edits",keys:["H"],action:"Hide or show",run:()=>t.toggleEnabled()},{group:"Edits",keys:["Delete","Backspace"],action:"Remove the edit; with a selecting tool, delete the selected elements",run:()=>t.remove()},{group:"Edits",keys:["Ctrl+D"],action:"Duplicate",run:()=>t.duplicate()},{group:"Edits",keys:["Ctrl+C"],action:"Copy as text; Ctrl+V pastes",run:()=>t.copy()},{group:"Edits",keys:["Shift+V"],action:"Paste from another scene",run:()=>s.paste()},{group:"Edits",keys:["Ctrl+Z"],action:"Undo",run:()=>t.command("undo")},{group:"Edits",keys:["Ctrl+Shift+Z","Ctrl+Y"],action:"Redo",run:()=>t.command("redo")},{group:"View",keys:["F"],action:"Focus on the cage, or on the surface under the mouse",run:()=>t.focus(e.position.x,e.position.y)},{group:"View",keys:["V"],action:"Color, depth, opacity, normals",run:()=>t.nextView()},{group:"View",keys:["L"],action:"Deformed lattice",run:()=>t.toggle("grid")},{group:"View",keys:["Shift+O"],action:"Show or hide the cages",run:()=>t.toggle("cages")},{group:"View",keys:["P"],action:"Before and after, side by side",run:()=>t.toggleSplit()},{group:"View",keys:["N"],action:"Show or hide the panel",run:()=>t.toggle("panel")},{group:"View",keys:["Home"],action:"Look from the start",run:()=>t.lookFrom(null)},{group:"View",keys:["["],action:"Previous camera of the scene; smaller brush",run:()=>t.resizeBrush(-1)||t.lookFrom(-1)},{group:"View",keys:["]"],action:"Next camera of the scene; larger brush",run:()=>t.resizeBrush(1)||t.lookFrom(1)},{group:"Scene",keys:["Ctrl+S"],action:"Save",run:()=>t.save()},{group:"Scene",keys:["Ctrl+Shift+S"],action:"Save as",run:()=>s.saveAs()},{group:"Scene",keys:["K"],action:"Keyframe of the camera path",run:()=>t.addKey()},{group:"Scene",keys:["?"],action:"All keys",run:()=>n.store.set({help:!n.store.now.help})}]}const IT=[{keys:["B"],action:"Before the edits, while held"},{keys:["Ctrl"],action:"While dragging: snap (15°, tenths, round lengths)"},{keys:["X","Y","Z"],action:"While dragging a corner, edge or face: along this axis"},{keys:["Wheel","PageUp","PageDown"],action:"While dragging points: radius of proportional editing"},{keys:["Shift+click"],action:"Choose corners, edges, faces or control points to drag together"},{keys:["Alt+click"],action:"Choose a row of a lattice's points; with Ctrl a plane; Shift adds"},{keys:["Shift+drag"],action:"Beside the cages: select in a rectangle"},{keys:["Shift","Ctrl"],action:"While selecting: add, subtract; both: intersect. Alt+drag orbits"},{keys:["Double-click"],action:"A new pair of cages around the surface there"},{keys:["Ctrl+double-click"],action:"A new control point on the surface there"},{keys:["Left","Right","Wheel"],action:"Orbit, pan, zoom"}];function NT(n){const t=n.altKey===!0?/^Key([A-Z])$/.exec(n.code??""):null;if(t!==null&&!n.ctrlKey)return`Alt+${t[1]}`;const e=n.key.length===1?n.key.toUpperCase():n.key,i=n.ctrlKey||n.metaKey?"Ctrl+":"",s=n.shiftKey&&/^[A-Z]$/.test(e)?"Shift+":"";return i+s+e}function UT(n,t,e,i){const s=new Map(i.flatMap(o=>o.keys.map(a=>[a,o])));addEventListener("keydown",o=>{if(ip(o.target)){o.key==="Enter"&&OT(o.target);return}const a=NT(o);if(o.key==="Control")return r(!0);if(a==="B"&&!o.repeat)return n.store.set({before:!0});if((a==="X"||a==="Y"||a==="Z")&&e.constrain(a))return;if(a==="PageUp"&&e.resizeReach(1)||a==="PageDown"&&e.resizeReach(-1))return o.preventDefault();if(a==="O"&&e.dragging&&!o.repeat)return n.store.set({proportional:!n.store.now.proportional}),e.applyMotion();const l=s.get(a);if(e.dragging&&a!=="Escape"){l&&o.preventDefault();return}if(!(a==="Ctrl+C"&&!getSelection()?.isCollapsed)&&l){if(o.preventDefault(),Xe(n.store.now)&&l.group!=="View"&&!LT.includes(a))return n.say(Kr,"warning");(!o.repeat||a.endsWith("Z"))&&l.run()}}),addEventListener("keyup",o=>{o.key==="Control"&&r(!1),o.key.toUpperCase()==="B"&&n.store.set({before:!1})}),addEventListener("blur",()=>n.store.set({before:!1})),addEventListener("paste",o=>{ip(o.target)||t.paste(o.clipboardData?.getData("text/plain")??"")});function r(o){e.snapKey=o,e.applyMotion()}}function OT(n){n instanceof HTMLInputElement&&setTimeout(()=>n.blur())}function ip(n){return n instanceof HTMLElement?n instanceof HTMLInputElement?!["checkbox","range","button","radio"].includes(n.type):n instanceof HTMLTextAreaElement||n instanceof HTMLSelectElement||n.closest("dialog")!==null:!1}const FT=15,kT=.1,BT=4,sp=7,zT=500,VT="XYZE";class HT{constructor(t){this.app=t;const{canvas:e}=t.viewport;e.addEventListener("pointerdown",s=>this.down(s),{capture:!0}),e.addEventListener("pointermove",s=>this.move(s)),e.addEventListener("pointerrawupdate",s=>{this.hold!==null&&this.readPosition(s)}),t.frames.beforeRequest.push(()=>this.applyNewMotion()),e.addEventListener("pointerup",s=>this.up(s)),e.addEventListener("pointercancel",()=>this.cancel()),e.addEventListener("pointerleave",()=>this.leave()),e.addEventListener("dblclick",s=>this.place(s));const i=s=>{s.deltaY===0||!this.resizeReach(s.deltaY<0?1:-1)||(s.preventDefault(),s.stopImmediatePropagation())};e.addEventListener("wheel",i,{capture:!0,passive:!1}),e.addEventListener("contextmenu",s=>s.preventDefault())}position={x:0,y:0};snapKey=!1;measure=()=>{};placeHotspot=()=>{};pickPoint=()=>{};constraint=null;hold=null;appliedAt={x:NaN,y:NaN};pressed=null;latestEvent={x:0,y:0,time:0};firstPress={time:-1/0,release:!0};get dragging(){return this.hold!==null}cancel(){return this.hold===null?!1:(this.hold.kind==="gizmo"&&this.app.gizmo.end(this.app.viewport.device(this.position.x,this.position.y)),this.hold=null,this.app.cancelDrag(),this.free(),!0)}constrain(t){return this.hold?.kind!=="part"?!1:(this.constraint=this.constraint===t?null:t,this.applyMotion(),!0)}applyMotion(){if(this.hold===null)return;const t=this.operation(this.hold),{drag:e}=this.app;if(this.appliedAt={...this.position},t===null||e===null)return;const i=om(e.edit.carrier,t),s=Dn(e.start,e.target);this.app.moveDrag(xE(this.snap(i),s,this.proportional),this.latestEvent.time)}resizeReach(t){const{store:e,drag:i}=this.app;if(this.hold===null||i===null||this.proportional===null)return!1;const s=Os(i.start.deformed.corners);return e.set({proportionalRadius:Hy(this.proportional.radius,t,s)}),this.applyMotion(),!0}get proportional(){const{proportional:t,proportionalRadius:e,curve:i}=this.app.store.now,{drag:s}=this.app;return!t||s===null||Dn(s.start,s.target).points===void 0?null:{radius:e??Os(s.start.deformed.corners),curve:i}}applyNewMotion(){(this.position.x!==this.appliedAt.x||this.position.y!==this.appliedAt.y)&&this.applyMotion()}down(t){this.readPosition(t),this.pressed={...this.position};const e=t.button!==0||t.altKey,i=e?null:this.partUnderPointer();if(t.timeStamp-this.firstPress.time>zT&&(this.firstPress={time:t.timeStamp,release:i===null&&this.app.gizmo.axis===null}),e||i===null&&this.app.gizmo.axis===null){this.app.camera.held=!0;return}t.stopImmediatePropagation(),this.app.viewport.orbit&&(this.app.viewport.orbit.enabled=!1),this.app.viewport.canvas.setPointerCapture(t.pointerId),i!==null&&t.shiftKey?this.toggleCorners(i.part):i!==null?this.grab(i):this.grabGizmo(),this.hold===null&&this.free()}move(t){this.readPosition(t),this.hold!==null?this.applyNewMotion():t.buttons===0&&this.app.store.now.selecting===null&&this.updateHover()}up(t){this.readPosition(t),this.app.camera.held=!1,this.hold!==null?(this.hold.kind==="gizmo"&&this.app.gizmo.end(this.app.viewport.device(this.position.x,this.position.y)),this.hold=null,this.app.endDrag()):this.pressed&&t.button===0&&this.travelPixels()<BT&&(this.app.store.now.measured!==null?this.measure(this.position.x,this.position.y):this.app.store.now.placesHotspot?this.placeHotspot(this.position.x,this.position.y):this.app.store.now.picked!==null?this.pickPoint(this.position.x,this.position.y):t.altKey?this.chooseRow(t):this.select()),this.free(),this.updateHover()}leave(){this.hold===null&&(this.app.gizmo.clearHover(),this.app.store.set({hover:null}),this.app.viewport.invalidate())}free(){this.constraint=null,this.pressed=null,this.app.viewport.orbit&&(this.app.viewport.orbit.enabled=!0)}updateHover(){const t=this.app.gizmo.axis,e=this.partUnderPointer(),i=this.app.gizmo.axis!==t;i&&this.app.viewport.invalidate();const s=this.app.store.now.hover,r=!(e?.cage===s?.cage&&e?.part.kind===s?.part.kind&&e?.part.index===s?.part.index);r&&this.app.store.set({hover:e}),(i&&this.app.gizmo.axis!==null||r&&e!==null)&&this.app.send({type:"drag_expected"}),this.app.viewport.canvas.style.cursor=e||this.app.gizmo.axis!==null?"pointer":""}partUnderPointer(){const{now:t}=this.app.store,e=xe(t);if(this.app.gizmo.clearHover(),Nr(t)||e===null||!_a(t)||Ur(t,e)!==null)return null;const{project:i}=this.app.viewport,{x:s,y:r}=this.position,o=mh(t,ai(e,this.app.drag));for(const{cage:c,posed:h}of o){const d=cm(s,r,h,i);if(d!==null)return{part:d,cage:c}}const a=this.app.gizmo.hover(this.app.viewport.device(s,r));if(a!==null&&a!==VT)return null;const l=this.app.viewport.camera.position.toArray();for(const{cage:c,posed:h}of o){const d=h.points===void 0?zS(s,r,{corners:h.corners,eye:l},i):VS(s,r,h,i);if(d!==null)return this.app.gizmo.clearHover(),{part:d,cage:c}}return null}toggleCorners(t){const e=this.app.store.now.corners,i=ga(t),s=i.every(r=>e.includes(r))?e.filter(r=>!i.includes(r)):[...new Set([...e,...i])].sort((r,o)=>r-o);this.app.store.set({corners:s})}grab(t){const{now:e}=this.app.store,i=ga(t.part),s=i.every(d=>e.corners.includes(d))&&e.corners.length>i.length,r=s?e.corners:i,o=this.app.beginDrag(e.mode==="edit"?"field":t.cage);if(o===null)return;!s&&e.corners.length>0&&this.app.store.set({corners:[]});const a=Dn(ai(o.edit,o),o.target),l=new C(...Yr(a,i)),c=t.part.kind==="face"&&!s?new C(...Wf(a.corners,t.part.index)):null,h=new Vn().setFromNormalAndCoplanarPoint(this.app.viewport.forward,l);this.hold={kind:"part",corners:r,at:l,grabbed:l,plane:h,line:c},this.hold.grabbed=this.targetPosition(this.hold)??l}grabGizmo(){const{corners:t}=this.app.store.now;this.app.beginDrag()!==null&&(this.app.gizmo.begin(this.app.viewport.device(this.position.x,this.position.y)),this.hold={kind:"gizmo",corners:[...t]})}operation(t){if(t.kind==="gizmo")return this.app.gizmo.move(this.app.viewport.device(this.position.x,this.position.y),t.corners);const e=this.targetPosition(t);return e===null?null:_m(t.corners,e.clone().sub(this.constraint===null?t.grabbed:t.at))}targetPosition(t){const e=this.app.viewport.ray(this.position.x,this.position.y),i={X:new C(1,0,0),Y:new C(0,1,0),Z:new C(0,0,1)};return this.constraint!==null?Dd(e,t.at,i[this.constraint]):t.line!==null?Dd(e,t.at,t.line):bE(e,t.at,t.plane.normal)}snap(t){const{now:e}=this.app.store,i=xe(e);if(e.snap===this.snapKey||i===null)return t;const s=Wy(2*Os(i.inner));return Gy(t,{length:s,angle:FT,factor:kT})}chooseRow(t){const{now:e}=this.app.store,i=xe(e);if(i===null||!_a(e)||Ur(e,i)!==null)return;const s=Dn(ai(i,this.app.drag),ui(e)),{x:r,y:o}=this.position,a=HS(r,o,s,this.app.viewport.project,sp);if(a===null||!s.shape||s.points===void 0)return;const{shape:l}=s,h=t.ctrlKey||t.metaKey?zy(l,a.point,this.facingAxis(s,a)):By(l,a),d=t.shiftKey?[...new Set([...e.corners,...h])].sort((u,p)=>u-p):h;this.app.store.set({corners:d})}facingAxis(t,{axis:e}){const i=this.app.viewport.forward,s=a=>{const[l,c]=[2*a,2*a+1].map(d=>ss[d]),h=new C(...Zn(t.corners,l));return Math.abs(new C(...Zn(t.corners,c)).sub(h).normalize().dot(i))},[r,o]=[0,1,2].filter(a=>a!==e);return s(r)>=s(o)?r:o}select(){const{now:t}=this.app.store,e=(t.state?.edits??[]).filter(i=>i.enabled).map(i=>{const s=ai(i,this.app.drag),r=Dn(s,ui(t));return{id:i.id,distance:GS(this.position.x,this.position.y,r,this.app.viewport.project)}}).filter(({distance:i})=>i<sp).sort((i,s)=>i.distance-s.distance);e.length>0&&!e.some(({id:i})=>i===t.state?.selected)&&this.app.send({type:"command",name:"select",edit:e[0].id})}place(t){if(this.readPosition(t),!this.firstPress.release||t.altKey||Nr(this.app.store.now))return;const{width:e,height:i}=this.app.viewport.points;this.app.expectEdit();const s={x:rp(this.position.x/e),y:rp(this.position.y/i)};this.app.send({type:t.ctrlKey||t.metaKey?"place_point":"place",...s})}travelPixels(){return this.pressed?Math.hypot(this.position.x-this.pressed.x,this.position.y-this.pressed.y):0}readPosition(t){const e=this.app.viewport.canvas.getBoundingClientRect();this.position={x:t.clientX-e.left,y:t.clientY-e.top},this.snapKey=t.ctrlKey,this.latestEvent={...this.position,time:t.timeStamp}}}function rp(n){return Math.min(1,Math.max(0,n))}const GT=2,WT=4e3,XT=3;function qT(n,t,{shiftKey:e,ctrlKey:i,metaKey:s}){const r=i||s;return e&&r?"intersect":e?"add":r?"subtract":n==="brush"&&t==="replace"?"add":t}function op({tool:n,points:t},e){if(n==="rectangle")return[t[0],e];const i=t[t.length-1];return Math.hypot(e.x-i.x,e.y-i.y)<GT?t:[...t,e]}function $T({tool:n,mode:t,points:e},i,s){const r=({x:o,y:a})=>[o/i.width,a/i.height];if(n==="flood"){const[o,a]=r(e[0]).map(h=>Math.min(1,Math.max(0,h))),{floodOpacity:l,floodReach:c}=s;return{type:"select_flood",x:o,y:a,threshold:l,reach:c,mode:t}}return n!=="brush"&&(KT(e)<XT||n==="lasso"&&e.length<3)?null:{type:"select_region",shape:n,points:YT(e).map(r),radius:s.brushRadius,mode:t,through:s.through,tolerance:s.depthTolerance}}function YT(n){let t=n;for(;t.length>WT;)t=t.filter((e,i)=>i%2===0||i===t.length-1);return t}function KT(n){const t=e=>Math.max(...e)-Math.min(...e);return Math.max(t(n.map(({x:e})=>e)),t(n.map(({y:e})=>e)))}const Cl="http://www.w3.org/2000/svg";class ZT{constructor(t){this.host=t,this.element.setAttribute("class","region"),this.element.append(this.shape,this.ring);const{canvas:e}=t.viewport;e.addEventListener("pointerdown",i=>this.down(i),{capture:!0}),e.addEventListener("pointermove",i=>this.move(i),{capture:!0}),e.addEventListener("pointerup",i=>this.up(i),{capture:!0}),e.addEventListener("pointercancel",()=>this.cancel(),{capture:!0}),e.addEventListener("pointerleave",()=>this.leave(),{capture:!0}),e.addEventListener("dblclick",i=>{t.store.now.selecting!==null&&i.stopImmediatePropagation()},{capture:!0}),t.store.watch(["selecting","brushRadius"],()=>this.show())}element=document.createElementNS(Cl,"svg");shape=document.createElementNS(Cl,"path");ring=document.createElementNS(Cl,"circle");drawn=null;position={x:-1,y:-1};inside=!1;cancel(){return this.drawn===null?!1:(this.drawn=null,this.show(),!0)}down(t){this.read(t);const{now:e}=this.host.store,i=e.hover===null&&this.host.gizmo.axis===null,s=t.shiftKey&&i?"rectangle":null,r=e.selecting??s;if(r===null||t.button!==0||t.altKey||Xe(e))return;t.stopImmediatePropagation(),this.host.viewport.canvas.setPointerCapture(t.pointerId);const{ctrlKey:o,metaKey:a}=t,l=e.selecting===null?{shiftKey:!1,ctrlKey:o,metaKey:a}:t;this.drawn={tool:r,mode:qT(r,e.selectMode,l),points:[{...this.position}]},r==="flood"&&this.finish(),this.show()}move(t){this.read(t),this.inside=!0,this.drawn!==null&&(t.stopImmediatePropagation(),this.drawn.points=op(this.drawn,{...this.position})),(this.drawn!==null||this.host.store.now.selecting!==null)&&this.show()}up(t){this.drawn!==null&&(t.stopImmediatePropagation(),this.read(t),this.drawn.points=op(this.drawn,{...this.position}),this.finish(),this.show())}leave(){this.inside=!1,this.show()}finish(){const{store:t,viewport:e,camera:i}=this.host,s=this.drawn===null?null:$T(this.drawn,e.points,t.now);this.drawn=null,s!==null&&(i.resting||i.restate(),this.host.send(s))}show(){const{selecting:t,brushRadius:e}=this.host.store.now,i=e*this.host.viewport.points.height,s=t==="brush";this.host.viewport.canvas.style.cursor=t===null?"":s?"none":"crosshair",this.ring.style.display=s&&this.inside?"":"none",this.ring.setAttribute("r",String(i)),this.ring.setAttribute("cx",String(this.position.x)),this.ring.setAttribute("cy",String(this.position.y)),this.shape.setAttribute("d",this.drawn===null?"":jT(this.drawn));const r=this.drawn?.tool==="brush";this.shape.setAttribute("class",`${r?"stroke":"outline"} ${this.drawn?.mode??""}`),this.shape.style.strokeWidth=r?`${2*i}px`:""}read(t){const e=this.host.viewport.canvas.getBoundingClientRect();this.position={x:t.clientX-e.left,y:t.clientY-e.top}}}function jT({tool:n,points:t}){if(n==="rectangle"){const[i,s]=[t[0],t[t.length-1]];return`M${i.x} ${i.y}H${s.x}V${s.y}H${i.x}Z`}const e=t.map(({x:i,y:s})=>`${i} ${s}`).join("L");return n==="lasso"?`M${e}Z`:`M${e}${t.length===1?"h0.01":""}`}/**
 * @license lucide v1.65.0 - ISC
 *
 * This source code is licensed under the ISC license.
 * See the LICENSE file in the root directory of this source tree.
 */const QT={xmlns:"http://www.w3.org/2000/svg",width:24,height:24,viewBox:"0 0 24 24",fill:"none",stroke:"currentColor","stroke-width":2,"stroke-linecap":"round","stroke-linejoin":"round"};/**
 * @license lucide v1.65.0 - ISC
 *
 * This source code is licensed under the ISC license.
 * See the LICENSE file in the root directory of this source tree.
 */const qm=([n,t,e])=>{const i=document.createElementNS("http://www.w3.org/2000/svg",n);return Object.keys(t).forEach(s=>{i.setAttribute(s,String(t[s]))}),e?.length&&e.forEach(s=>{const r=qm(s);i.appendChild(r)}),i},JT=(n,t={})=>{const i={...QT,...t};return qm(["svg",i,n])};/**
 * @license lucide v1.65.0 - ISC
 *
 * This source code is licensed under the ISC license.
 * See the LICENSE file in the root directory of this source tree.
 */const tA=[["path",{d:"M13.5 10.5 15 9"}],["path",{d:"M4 4v15a1 1 0 0 0 1 1h15"}],["path",{d:"M4.293 19.707 6 18"}],["path",{d:"m9 15 1.5-1.5"}]];/**
 * @license lucide v1.65.0 - ISC
 *
 * This source code is licensed under the ISC license.
 * See the LICENSE file in the root directory of this source tree.
 */const eA=[["path",{d:"M21 8a2 2 0 0 0-1-1.73l-7-4a2 2 0 0 0-2 0l-7 4A2 2 0 0 0 3 8v8a2 2 0 0 0 1 1.73l7 4a2 2 0 0 0 2 0l7-4A2 2 0 0 0 21 16Z"}],["path",{d:"m3.3 7 8.7 5 8.7-5"}],["path",{d:"M12 22V12"}]];/**
 * @license lucide v1.65.0 - ISC
 *
 * This source code is licensed under the ISC license.
 * See the LICENSE file in the root directory of this source tree.
 */const nA=[["path",{d:"M2.97 12.92A2 2 0 0 0 2 14.63v3.24a2 2 0 0 0 .97 1.71l3 1.8a2 2 0 0 0 2.06 0L12 19v-5.5l-5-3-4.03 2.42Z"}],["path",{d:"m7 16.5-4.74-2.85"}],["path",{d:"m7 16.5 5-3"}],["path",{d:"M7 16.5v5.17"}],["path",{d:"M12 13.5V19l3.97 2.38a2 2 0 0 0 2.06 0l3-1.8a2 2 0 0 0 .97-1.71v-3.24a2 2 0 0 0-.97-1.71L17 10.5l-5 3Z"}],["path",{d:"m17 16.5-5-3"}],["path",{d:"m17 16.5 4.74-2.85"}],["path",{d:"M17 16.5v5.17"}],["path",{d:"M7.97 4.42A2 2 0 0 0 7 6.13v4.37l5 3 5-3V6.13a2 2 0 0 0-.97-1.71l-3-1.8a2 2 0 0 0-2.06 0l-3 1.8Z"}],["path",{d:"M12 8 7.26 5.15"}],["path",{d:"m12 8 4.74-2.85"}],["path",{d:"M12 13.5V8"}]];/**
 * @license lucide v1.65.0 - ISC
 *
 * This source code is licensed under the ISC license.
 * See the LICENSE file in the root directory of this source tree.
 */const iA=[["path",{d:"M13.997 4a2 2 0 0 1 1.76 1.05l.486.9A2 2 0 0 0 18.003 7H20a2 2 0 0 1 2 2v9a2 2 0 0 1-2 2H4a2 2 0 0 1-2-2V9a2 2 0 0 1 2-2h1.997a2 2 0 0 0 1.759-1.048l.489-.904A2 2 0 0 1 10.004 4z"}],["circle",{cx:"12",cy:"13",r:"3"}]];/**
 * @license lucide v1.65.0 - ISC
 *
 * This source code is licensed under the ISC license.
 * See the LICENSE file in the root directory of this source tree.
 */const sA=[["path",{d:"m6 9 6 6 6-6"}]];/**
 * @license lucide v1.65.0 - ISC
 *
 * This source code is licensed under the ISC license.
 * See the LICENSE file in the root directory of this source tree.
 */const $m=[["path",{d:"m18 15-6-6-6 6"}]];/**
 * @license lucide v1.65.0 - ISC
 *
 * This source code is licensed under the ISC license.
 * See the LICENSE file in the root directory of this source tree.
 */const rA=[["circle",{cx:"12",cy:"12",r:"1"}],["circle",{cx:"12",cy:"12",r:"10"}]];/**
 * @license lucide v1.65.0 - ISC
 *
 * This source code is licensed under the ISC license.
 * See the LICENSE file in the root directory of this source tree.
 */const oA=[["circle",{cx:"12",cy:"12",r:"10"}],["path",{d:"M9.09 9a3 3 0 0 1 5.83 1c0 2-3 3-3 3"}],["path",{d:"M12 17h.01"}]];/**
 * @license lucide v1.65.0 - ISC
 *
 * This source code is licensed under the ISC license.
 * See the LICENSE file in the root directory of this source tree.
 */const aA=[["path",{d:"M11 14h10"}],["path",{d:"M16 4h2a2 2 0 0 1 2 2v1.344"}],["path",{d:"m17 18 4-4-4-4"}],["path",{d:"M8 4H6a2 2 0 0 0-2 2v14a2 2 0 0 0 2 2h12a2 2 0 0 0 1.793-1.113"}],["rect",{x:"8",y:"2",width:"8",height:"4",rx:"1"}]];/**
 * @license lucide v1.65.0 - ISC
 *
 * This source code is licensed under the ISC license.
 * See the LICENSE file in the root directory of this source tree.
 */const lA=[["rect",{width:"18",height:"18",x:"3",y:"3",rx:"2"}],["path",{d:"M12 3v18"}]];/**
 * @license lucide v1.65.0 - ISC
 *
 * This source code is licensed under the ISC license.
 * See the LICENSE file in the root directory of this source tree.
 */const cA=[["circle",{cx:"12",cy:"12",r:"10"}],["path",{d:"m16.24 7.76-1.804 5.411a2 2 0 0 1-1.265 1.265L7.76 16.24l1.804-5.411a2 2 0 0 1 1.265-1.265z"}]];/**
 * @license lucide v1.65.0 - ISC
 *
 * This source code is licensed under the ISC license.
 * See the LICENSE file in the root directory of this source tree.
 */const hA=[["rect",{width:"14",height:"14",x:"8",y:"8",rx:"2",ry:"2"}],["path",{d:"M4 16c-1.1 0-2-.9-2-2V4c0-1.1.9-2 2-2h10c1.1 0 2 .9 2 2"}]];/**
 * @license lucide v1.65.0 - ISC
 *
 * This source code is licensed under the ISC license.
 * See the LICENSE file in the root directory of this source tree.
 */const Ym=[["circle",{cx:"12",cy:"12",r:"10"}],["line",{x1:"22",x2:"18",y1:"12",y2:"12"}],["line",{x1:"6",x2:"2",y1:"12",y2:"12"}],["line",{x1:"12",x2:"12",y1:"6",y2:"2"}],["line",{x1:"12",x2:"12",y1:"22",y2:"18"}]];/**
 * @license lucide v1.65.0 - ISC
 *
 * This source code is licensed under the ISC license.
 * See the LICENSE file in the root directory of this source tree.
 */const Km=[["path",{d:"M12 15V3"}],["path",{d:"M21 15v4a2 2 0 0 1-2 2H5a2 2 0 0 1-2-2v-4"}],["path",{d:"m7 10 5 5 5-5"}]];/**
 * @license lucide v1.65.0 - ISC
 *
 * This source code is licensed under the ISC license.
 * See the LICENSE file in the root directory of this source tree.
 */const uA=[["path",{d:"M10.733 5.076a10.744 10.744 0 0 1 11.205 6.575 1 1 0 0 1 0 .696 10.747 10.747 0 0 1-1.444 2.49"}],["path",{d:"M14.084 14.158a3 3 0 0 1-4.242-4.242"}],["path",{d:"M17.479 17.499a10.75 10.75 0 0 1-15.417-5.151 1 1 0 0 1 0-.696 10.75 10.75 0 0 1 4.446-5.143"}],["path",{d:"m2 2 20 20"}]];/**
 * @license lucide v1.65.0 - ISC
 *
 * This source code is licensed under the ISC license.
 * See the LICENSE file in the root directory of this source tree.
 */const dA=[["path",{d:"M2.062 12.348a1 1 0 0 1 0-.696 10.75 10.75 0 0 1 19.876 0 1 1 0 0 1 0 .696 10.75 10.75 0 0 1-19.876 0"}],["circle",{cx:"12",cy:"12",r:"3"}]];/**
 * @license lucide v1.65.0 - ISC
 *
 * This source code is licensed under the ISC license.
 * See the LICENSE file in the root directory of this source tree.
 */const pA=[["path",{d:"M6 22a2 2 0 0 1-2-2V4a2 2 0 0 1 2-2h8a2.4 2.4 0 0 1 1.704.706l3.588 3.588A2.4 2.4 0 0 1 20 8v12a2 2 0 0 1-2 2z"}],["path",{d:"M14 2v5a1 1 0 0 0 1 1h5"}],["path",{d:"M12 18v-6"}],["path",{d:"m9 15 3 3 3-3"}]];/**
 * @license lucide v1.65.0 - ISC
 *
 * This source code is licensed under the ISC license.
 * See the LICENSE file in the root directory of this source tree.
 */const fA=[["path",{d:"m6 14 1.5-2.9A2 2 0 0 1 9.24 10H20a2 2 0 0 1 1.94 2.5l-1.54 6a2 2 0 0 1-1.95 1.5H4a2 2 0 0 1-2-2V5a2 2 0 0 1 2-2h3.9a2 2 0 0 1 1.69.9l.81 1.2a2 2 0 0 0 1.67.9H18a2 2 0 0 1 2 2v2"}]];/**
 * @license lucide v1.65.0 - ISC
 *
 * This source code is licensed under the ISC license.
 * See the LICENSE file in the root directory of this source tree.
 */const mA=[["circle",{cx:"12",cy:"12",r:"10"}],["path",{d:"M12 2a14.5 14.5 0 0 0 0 20 14.5 14.5 0 0 0 0-20"}],["path",{d:"M2 12h20"}]];/**
 * @license lucide v1.65.0 - ISC
 *
 * This source code is licensed under the ISC license.
 * See the LICENSE file in the root directory of this source tree.
 */const gA=[["rect",{width:"18",height:"18",x:"3",y:"3",rx:"2"}],["path",{d:"M3 9h18"}],["path",{d:"M3 15h18"}],["path",{d:"M9 3v18"}],["path",{d:"M15 3v18"}]];/**
 * @license lucide v1.65.0 - ISC
 *
 * This source code is licensed under the ISC license.
 * See the LICENSE file in the root directory of this source tree.
 */const vA=[["path",{d:"M10 18v-7"}],["path",{d:"M11.119 2.205a2 2 0 0 1 1.762 0l7.84 3.846A.5.5 0 0 1 20.5 7h-17a.5.5 0 0 1-.22-.949z"}],["path",{d:"M14 18v-7"}],["path",{d:"M18 18v-7"}],["path",{d:"M3 22h18"}],["path",{d:"M6 18v-7"}]];/**
 * @license lucide v1.65.0 - ISC
 *
 * This source code is licensed under the ISC license.
 * See the LICENSE file in the root directory of this source tree.
 */const _A=[["path",{d:"M7 22a5 5 0 0 1-2-4"}],["path",{d:"M7 16.93c.96.43 1.96.74 2.99.91"}],["path",{d:"M3.34 14A6.8 6.8 0 0 1 2 10c0-4.42 4.48-8 10-8s10 3.58 10 8a7.19 7.19 0 0 1-.33 2"}],["path",{d:"M5 18a2 2 0 1 0 0-4 2 2 0 0 0 0 4z"}],["path",{d:"M14.33 22h-.09a.35.35 0 0 1-.24-.32v-10a.34.34 0 0 1 .33-.34c.08 0 .15.03.21.08l7.34 6a.33.33 0 0 1-.21.59h-4.49l-2.57 3.85a.35.35 0 0 1-.28.14z"}]];/**
 * @license lucide v1.65.0 - ISC
 *
 * This source code is licensed under the ISC license.
 * See the LICENSE file in the root directory of this source tree.
 */const xA=[["rect",{width:"18",height:"11",x:"3",y:"11",rx:"2",ry:"2"}],["path",{d:"M7 11V7a5 5 0 0 1 9.9-1"}]];/**
 * @license lucide v1.65.0 - ISC
 *
 * This source code is licensed under the ISC license.
 * See the LICENSE file in the root directory of this source tree.
 */const bA=[["rect",{width:"18",height:"11",x:"3",y:"11",rx:"2",ry:"2"}],["path",{d:"M7 11V7a5 5 0 0 1 10 0v4"}]];/**
 * @license lucide v1.65.0 - ISC
 *
 * This source code is licensed under the ISC license.
 * See the LICENSE file in the root directory of this source tree.
 */const wA=[["path",{d:"m12 15 4 4"}],["path",{d:"M2.352 10.648a1.205 1.205 0 0 0 0 1.704l2.296 2.296a1.205 1.205 0 0 0 1.704 0l6.029-6.029a1 1 0 1 1 3 3l-6.029 6.029a1.205 1.205 0 0 0 0 1.704l2.296 2.296a1.205 1.205 0 0 0 1.704 0l6.365-6.367A1 1 0 0 0 8.716 4.282z"}],["path",{d:"m5 8 4 4"}]];/**
 * @license lucide v1.65.0 - ISC
 *
 * This source code is licensed under the ISC license.
 * See the LICENSE file in the root directory of this source tree.
 */const Zm=[["path",{d:"M20 10c0 4.993-5.539 10.193-7.399 11.799a1 1 0 0 1-1.202 0C9.539 20.193 4 14.993 4 10a8 8 0 0 1 16 0"}],["circle",{cx:"12",cy:"10",r:"3"}]];/**
 * @license lucide v1.65.0 - ISC
 *
 * This source code is licensed under the ISC license.
 * See the LICENSE file in the root directory of this source tree.
 */const yA=[["path",{d:"M4.037 4.688a.495.495 0 0 1 .651-.651l16 6.5a.5.5 0 0 1-.063.947l-6.124 1.58a2 2 0 0 0-1.438 1.435l-1.579 6.126a.5.5 0 0 1-.947.063z"}]];/**
 * @license lucide v1.65.0 - ISC
 *
 * This source code is licensed under the ISC license.
 * See the LICENSE file in the root directory of this source tree.
 */const SA=[["path",{d:"M5 3v16h16"}],["path",{d:"m5 19 6-6"}],["path",{d:"m2 6 3-3 3 3"}],["path",{d:"m18 16 3 3-3 3"}]];/**
 * @license lucide v1.65.0 - ISC
 *
 * This source code is licensed under the ISC license.
 * See the LICENSE file in the root directory of this source tree.
 */const EA=[["path",{d:"M11 7 6 2"}],["path",{d:"M18.992 12H2.041"}],["path",{d:"M21.145 18.38A3.34 3.34 0 0 1 20 16.5a3.3 3.3 0 0 1-1.145 1.88c-.575.46-.855 1.02-.855 1.595A2 2 0 0 0 20 22a2 2 0 0 0 2-2.025c0-.58-.285-1.13-.855-1.595"}],["path",{d:"m8.5 4.5 2.148-2.148a1.205 1.205 0 0 1 1.704 0l7.296 7.296a1.205 1.205 0 0 1 0 1.704l-7.592 7.592a3.615 3.615 0 0 1-5.112 0l-3.888-3.888a3.615 3.615 0 0 1 0-5.112L5.67 7.33"}]];/**
 * @license lucide v1.65.0 - ISC
 *
 * This source code is licensed under the ISC license.
 * See the LICENSE file in the root directory of this source tree.
 */const MA=[["path",{d:"m14.622 17.897-10.68-2.913"}],["path",{d:"M18.376 2.622a1 1 0 1 1 3.002 3.002L17.36 9.643a.5.5 0 0 0 0 .707l.944.944a2.41 2.41 0 0 1 0 3.408l-.944.944a.5.5 0 0 1-.707 0L8.354 7.348a.5.5 0 0 1 0-.707l.944-.944a2.41 2.41 0 0 1 3.408 0l.944.944a.5.5 0 0 0 .707 0z"}],["path",{d:"M9 8c-1.804 2.71-3.97 3.46-6.583 3.948a.507.507 0 0 0-.302.819l7.32 8.883a1 1 0 0 0 1.185.204C12.735 20.405 16 16.792 16 15"}]];/**
 * @license lucide v1.65.0 - ISC
 *
 * This source code is licensed under the ISC license.
 * See the LICENSE file in the root directory of this source tree.
 */const TA=[["rect",{width:"18",height:"18",x:"3",y:"3",rx:"2"}],["path",{d:"M15 3v18"}]];/**
 * @license lucide v1.65.0 - ISC
 *
 * This source code is licensed under the ISC license.
 * See the LICENSE file in the root directory of this source tree.
 */const AA=[["path",{d:"M13 7 8.7 2.7a2.41 2.41 0 0 0-3.4 0L2.7 5.3a2.41 2.41 0 0 0 0 3.4L7 13"}],["path",{d:"m8 6 2-2"}],["path",{d:"m18 16 2-2"}],["path",{d:"m17 11 4.3 4.3c.94.94.94 2.46 0 3.4l-2.6 2.6c-.94.94-2.46.94-3.4 0L11 17"}],["path",{d:"M21.174 6.812a1 1 0 0 0-3.986-3.987L3.842 16.174a2 2 0 0 0-.5.83l-1.321 4.352a.5.5 0 0 0 .623.622l4.353-1.32a2 2 0 0 0 .83-.497z"}],["path",{d:"m15 5 4 4"}]];/**
 * @license lucide v1.65.0 - ISC
 *
 * This source code is licensed under the ISC license.
 * See the LICENSE file in the root directory of this source tree.
 */const CA=[["path",{d:"M21.174 6.812a1 1 0 0 0-3.986-3.987L3.842 16.174a2 2 0 0 0-.5.83l-1.321 4.352a.5.5 0 0 0 .623.622l4.353-1.32a2 2 0 0 0 .83-.497z"}],["path",{d:"m15 5 4 4"}]];/**
 * @license lucide v1.65.0 - ISC
 *
 * This source code is licensed under the ISC license.
 * See the LICENSE file in the root directory of this source tree.
 */const ap=[["path",{d:"M5 5a2 2 0 0 1 3.008-1.728l11.997 6.998a2 2 0 0 1 .003 3.458l-12 7A2 2 0 0 1 5 19z"}]];/**
 * @license lucide v1.65.0 - ISC
 *
 * This source code is licensed under the ISC license.
 * See the LICENSE file in the root directory of this source tree.
 */const jm=[["path",{d:"M5 12h14"}],["path",{d:"M12 5v14"}]];/**
 * @license lucide v1.65.0 - ISC
 *
 * This source code is licensed under the ISC license.
 * See the LICENSE file in the root directory of this source tree.
 */const RA=[["path",{d:"M2.5 16.88a1 1 0 0 1-.32-1.43l9-13.02a1 1 0 0 1 1.64 0l9 13.01a1 1 0 0 1-.32 1.44l-8.51 4.86a2 2 0 0 1-1.98 0Z"}],["path",{d:"M12 2v20"}]];/**
 * @license lucide v1.65.0 - ISC
 *
 * This source code is licensed under the ISC license.
 * See the LICENSE file in the root directory of this source tree.
 */const PA=[["path",{d:"M20.34 17.52a10 10 0 1 0-2.82 2.82"}],["circle",{cx:"19",cy:"19",r:"2"}],["path",{d:"m13.41 13.41 4.18 4.18"}],["circle",{cx:"12",cy:"12",r:"2"}]];/**
 * @license lucide v1.65.0 - ISC
 *
 * This source code is licensed under the ISC license.
 * See the LICENSE file in the root directory of this source tree.
 */const LA=[["path",{d:"m15 14 5-5-5-5"}],["path",{d:"M20 9H9.5A5.5 5.5 0 0 0 4 14.5A5.5 5.5 0 0 0 9.5 20H13"}]];/**
 * @license lucide v1.65.0 - ISC
 *
 * This source code is licensed under the ISC license.
 * See the LICENSE file in the root directory of this source tree.
 */const Qm=[["path",{d:"M3 12a9 9 0 0 1 9-9 9.75 9.75 0 0 1 6.74 2.74L21 8"}],["path",{d:"M21 3v5h-5"}],["path",{d:"M21 12a9 9 0 0 1-9 9 9.75 9.75 0 0 1-6.74-2.74L3 16"}],["path",{d:"M8 16H3v5"}]];/**
 * @license lucide v1.65.0 - ISC
 *
 * This source code is licensed under the ISC license.
 * See the LICENSE file in the root directory of this source tree.
 */const DA=[["path",{d:"m17 2 4 4-4 4"}],["path",{d:"M3 11v-1a4 4 0 0 1 4-4h14"}],["path",{d:"m7 22-4-4 4-4"}],["path",{d:"M21 13v1a4 4 0 0 1-4 4H3"}]];/**
 * @license lucide v1.65.0 - ISC
 *
 * This source code is licensed under the ISC license.
 * See the LICENSE file in the root directory of this source tree.
 */const IA=[["path",{d:"m15.194 13.707 3.814 1.86-1.86 3.814"}],["path",{d:"M16.47214 7.52786 A 5 10 0 1 0 13 21.79796"}],["path",{d:"M21.79796 11 A 10 5 0 1 0 19 15.57071"}]];/**
 * @license lucide v1.65.0 - ISC
 *
 * This source code is licensed under the ISC license.
 * See the LICENSE file in the root directory of this source tree.
 */const NA=[["circle",{cx:"6",cy:"19",r:"3"}],["path",{d:"M9 19h8.5a3.5 3.5 0 0 0 0-7h-11a3.5 3.5 0 0 1 0-7H15"}],["circle",{cx:"18",cy:"5",r:"3"}]];/**
 * @license lucide v1.65.0 - ISC
 *
 * This source code is licensed under the ISC license.
 * See the LICENSE file in the root directory of this source tree.
 */const Jm=[["path",{d:"M21.3 15.3a2.4 2.4 0 0 1 0 3.4l-2.6 2.6a2.4 2.4 0 0 1-3.4 0L2.7 8.7a2.41 2.41 0 0 1 0-3.4l2.6-2.6a2.41 2.41 0 0 1 3.4 0Z"}],["path",{d:"m14.5 12.5 2-2"}],["path",{d:"m11.5 9.5 2-2"}],["path",{d:"m8.5 6.5 2-2"}],["path",{d:"m17.5 15.5 2-2"}]];/**
 * @license lucide v1.65.0 - ISC
 *
 * This source code is licensed under the ISC license.
 * See the LICENSE file in the root directory of this source tree.
 */const UA=[["path",{d:"M10 2v3a1 1 0 0 0 1 1h5"}],["path",{d:"M18 18v-6a1 1 0 0 0-1-1h-6a1 1 0 0 0-1 1v6"}],["path",{d:"M18 22H4a2 2 0 0 1-2-2V6"}],["path",{d:"M8 18a2 2 0 0 1-2-2V4a2 2 0 0 1 2-2h9.172a2 2 0 0 1 1.414.586l2.828 2.828A2 2 0 0 1 22 6.828V16a2 2 0 0 1-2.01 2z"}]];/**
 * @license lucide v1.65.0 - ISC
 *
 * This source code is licensed under the ISC license.
 * See the LICENSE file in the root directory of this source tree.
 */const OA=[["path",{d:"M15.2 3a2 2 0 0 1 1.4.6l3.8 3.8a2 2 0 0 1 .6 1.4V19a2 2 0 0 1-2 2H5a2 2 0 0 1-2-2V5a2 2 0 0 1 2-2z"}],["path",{d:"M17 21v-7a1 1 0 0 0-1-1H8a1 1 0 0 0-1 1v7"}],["path",{d:"M7 3v4a1 1 0 0 0 1 1h7"}]];/**
 * @license lucide v1.65.0 - ISC
 *
 * This source code is licensed under the ISC license.
 * See the LICENSE file in the root directory of this source tree.
 */const FA=[["path",{d:"M5 7v11a1 1 0 0 0 1 1h11"}],["path",{d:"M5.293 18.707 11 13"}],["circle",{cx:"19",cy:"19",r:"2"}],["circle",{cx:"5",cy:"5",r:"2"}]];/**
 * @license lucide v1.65.0 - ISC
 *
 * This source code is licensed under the ISC license.
 * See the LICENSE file in the root directory of this source tree.
 */const kA=[["circle",{cx:"19",cy:"5",r:"2"}],["circle",{cx:"5",cy:"19",r:"2"}],["path",{d:"M5 17A12 12 0 0 1 17 5"}]];/**
 * @license lucide v1.65.0 - ISC
 *
 * This source code is licensed under the ISC license.
 * See the LICENSE file in the root directory of this source tree.
 */const BA=[["path",{d:"M8 3H5a2 2 0 0 0-2 2v14c0 1.1.9 2 2 2h3"}],["path",{d:"M16 3h3a2 2 0 0 1 2 2v14a2 2 0 0 1-2 2h-3"}],["path",{d:"M12 20v2"}],["path",{d:"M12 14v2"}],["path",{d:"M12 8v2"}],["path",{d:"M12 2v2"}]];/**
 * @license lucide v1.65.0 - ISC
 *
 * This source code is licensed under the ISC license.
 * See the LICENSE file in the root directory of this source tree.
 */const zA=[["path",{d:"M12.034 12.681a.498.498 0 0 1 .647-.647l9 3.5a.5.5 0 0 1-.033.943l-3.444 1.068a1 1 0 0 0-.66.66l-1.067 3.443a.5.5 0 0 1-.943.033z"}],["path",{d:"M5 3a2 2 0 0 0-2 2"}],["path",{d:"M19 3a2 2 0 0 1 2 2"}],["path",{d:"M5 21a2 2 0 0 1-2-2"}],["path",{d:"M9 3h1"}],["path",{d:"M9 21h2"}],["path",{d:"M14 3h1"}],["path",{d:"M3 9v1"}],["path",{d:"M21 9v2"}],["path",{d:"M3 14v1"}]];/**
 * @license lucide v1.65.0 - ISC
 *
 * This source code is licensed under the ISC license.
 * See the LICENSE file in the root directory of this source tree.
 */const VA=[["path",{d:"M5 3a2 2 0 0 0-2 2"}],["path",{d:"M19 3a2 2 0 0 1 2 2"}],["path",{d:"M21 19a2 2 0 0 1-2 2"}],["path",{d:"M5 21a2 2 0 0 1-2-2"}],["path",{d:"M9 3h1"}],["path",{d:"M9 21h1"}],["path",{d:"M14 3h1"}],["path",{d:"M14 21h1"}],["path",{d:"M3 9v1"}],["path",{d:"M21 9v1"}],["path",{d:"M3 14v1"}],["path",{d:"M21 14v1"}]];/**
 * @license lucide v1.65.0 - ISC
 *
 * This source code is licensed under the ISC license.
 * See the LICENSE file in the root directory of this source tree.
 */const tg=[["rect",{width:"18",height:"18",x:"3",y:"3",rx:"2"}]];/**
 * @license lucide v1.65.0 - ISC
 *
 * This source code is licensed under the ISC license.
 * See the LICENSE file in the root directory of this source tree.
 */const Th=[["path",{d:"M10 11v6"}],["path",{d:"M14 11v6"}],["path",{d:"M19 6v14a2 2 0 0 1-2 2H7a2 2 0 0 1-2-2V6"}],["path",{d:"M3 6h18"}],["path",{d:"M8 6V4a2 2 0 0 1 2-2h4a2 2 0 0 1 2 2v2"}]];/**
 * @license lucide v1.65.0 - ISC
 *
 * This source code is licensed under the ISC license.
 * See the LICENSE file in the root directory of this source tree.
 */const HA=[["path",{d:"m21.73 18-8-14a2 2 0 0 0-3.48 0l-8 14A2 2 0 0 0 4 21h16a2 2 0 0 0 1.73-3"}],["path",{d:"M12 9v4"}],["path",{d:"M12 17h.01"}]];/**
 * @license lucide v1.65.0 - ISC
 *
 * This source code is licensed under the ISC license.
 * See the LICENSE file in the root directory of this source tree.
 */const eg=[["path",{d:"M9 14 4 9l5-5"}],["path",{d:"M4 9h10.5a5.5 5.5 0 0 1 5.5 5.5a5.5 5.5 0 0 1-5.5 5.5H11"}]];/**
 * @license lucide v1.65.0 - ISC
 *
 * This source code is licensed under the ISC license.
 * See the LICENSE file in the root directory of this source tree.
 */const GA=[["path",{d:"M18 6 6 18"}],["path",{d:"m6 6 12 12"}]];function G(n,{class:t,data:e,...i}={},...s){const r=document.createElement(n);return t!==void 0&&(r.className=t),Object.assign(r.dataset,e),Object.assign(r,i),r.append(...s.filter(o=>o!==null)),r}function Zr(n,t=18){return JT(n,{width:t,height:t,"stroke-width":1.75,"aria-hidden":"true"})}function At(n,t,e,i=""){const s=G("button",{class:`icon ${i}`,title:t,type:"button",onclick:e},Zr(n));return s.setAttribute("aria-label",t),s}function Oc(n,t,e,i){return G("a",{class:"icon",title:t,href:e,download:i,ariaLabel:t},Zr(n))}function cs(n,...t){return G("details",{class:"section",open:!0},G("summary",{},n),...t)}function WA(n,t){const e=G("div",{class:"quiet scale"}),i=G("div",{class:"quiet up-direction"}),s=At(Jm,"Scale: measure between two points (Shift+M)",()=>t.toggleMeasuring(),"scale-measure"),r=At(cA,"Up: three points of something level (Shift+Y)",()=>t.togglePicking("up"),"up-points"),o=At(vA,"Up: the floor, the largest plane that is nearly level",()=>n.send({type:"up_change",by:"floor"}),"up-floor"),a=At(eg,"Up as the cameras have it",()=>n.send({type:"up_change",by:"cameras"}),"up-cameras");return n.store.watch(["state","measured","picked"],({state:l,measured:c,picked:h})=>{e.textContent=XA(l),i.textContent=qA(l),a.disabled=l?.up==null,s.classList.toggle("on",c!==null),r.classList.toggle("on",h?.purpose==="up")}),cs("Scale and up",G("div",{class:"bar"},s,r,o,a),e,i)}function XA(n){const t=n?.meters_per_unit??null;return t===null?"Scale: units of the capture":`Scale: ${Number(t.toPrecision(4))} m per unit`}function qA(n){const t=n?.up??null;return t===null?"Up: as the cameras have it":`Up: (${t.map(e=>Mn(e,3)).join(", ")})`}const lp=[["ply",".ply: every program, large"],["spz",".spz: a tenth of that"],["sog",".sog: for the web, smallest"],["compressed.ply",".compressed.ply: PlayCanvas"],["splat",".splat: no view-dependent color"],["glb",".glb: glTF"],["usda",".usda: USD text, largest"],["usdc",".usdc: USD, with usd-core"],["usdz",".usdz: USD package, with usd-core"]],$A=[["lod",".zip: streamed SOG, levels of detail for the web"]],Fc="page",Er="levels",ng=[[Fc,".html: a page for any browser, with path and hotspots"]],YA=[...ng,[Er,".zip: a page with levels of detail, for a web site"]];function ig({id:n,title:t,text:e,position:i,camera:s,follows:r}){return{type:"put_hotspot",hotspot:n,title:t,text:e,position:i,camera:s,follows:r}}const KA=120,ZA=2e3;function jA(n){const t=G("div"),e=(a,l)=>G("label",{class:"field"},G("span",{},a),l),i=a=>G("input",{type:"text",value:a,required:!0,maxLength:1e3,spellcheck:!1}),s=(a,l,c)=>G("input",{type:"number",value:String(a),min:String(l),max:String(c),required:!0}),r=()=>G("input",{type:"checkbox"});function o(a,l,c,h){const d=G("button",{type:"button",class:"text",onclick:()=>p.close()},"Cancel"),u=G("form",{method:"dialog"},G("h2",{},a),...c,G("div",{class:"bar end"},d,G("button",{class:"text primary"},l))),p=G("dialog",{onclose:()=>p.remove()},u);u.onsubmit=h,t.append(p),p.showModal()}return{element:t,saveAs(){const a=i(n.store.now.state?.path??""),l=r();o("Save the scene as","Save",[e("Folder",a),e("Replace what is there",l)],()=>{n.send({type:"save_as",path:a.value,overwrite:l.checked})}),a.select()},paste(){n.ask({what:"sources"}).then(a=>{if(a===null||a.failed)return;const l=n.store.now.hello?.splats===!0;if(a.sources.length===0){const h=l?"no other scene of splats and no splat file":"no other scene of voxels";n.say(`${h} lies beside this scene; put one there, or start the editor with --root`,"warning");return}const c=G("select",{name:"source"},...a.sources.map(h=>G("option",{value:h},h)));o("Paste from another scene","Paste",[G("label",{class:"field"},G("span",{},l?"Scene or file":"Scene"),c)],()=>{n.expectEdit(),n.send({type:"paste_scene",source:c.value})})})},scale(a){const l=n.store.now.state?.meters_per_unit??null,c=G("input",{type:"number",min:"0",step:"any",required:!0,name:"meters"});c.value=l===null?"":String(Number((a*l).toPrecision(6))),o(`Distance: ${Qf(a,null)}`,"Set the scale",[e("Meters",c)],()=>{const h=Number(c.value);h>0&&n.send({type:"scale_change",meters_per_unit:h/a})})},align(a){const l=xe(n.store.now);if(l===null)return;const c=G("input",{type:"checkbox",name:"refine",checked:!0}),h=G("input",{type:"checkbox",name:"keep_scale"}),d=G("input",{type:"checkbox",name:"match_colors"}),u=[e("Bring the surfaces together (ICP)",c),e("Keep the scale of the pairs",h),e("Match the colors",d)];o(`Align “${l.name}” by ${a.length} pairs`,"Align",u,()=>{n.store.set({picked:null}),n.send({type:"align_paste",edit:l.id,pairs:a,refine:c.checked,keep_scale:h.checked,match_colors:d.checked})})},hotspot(a){const l=G("input",{value:a.title,required:!0,maxLength:KA,name:"title"}),c=G("textarea",{value:a.text,maxLength:ZA,name:"text",rows:5}),h=G("input",{type:"checkbox",name:"view",checked:a.camera!==null}),d=G("input",{type:"checkbox",name:"follows",checked:a.follows}),u=[e("Title",l),e("Text",c),e("Look from this view",h),e("Follow the edits",d)];o(a.id===null?"New hotspot":"Hotspot",a.id===null?"Place":"Change",u,()=>{if(l.value.trim()==="")return;const{camera:p,fov:g}={camera:n.viewport.c2w,fov:n.viewport.camera.fov},x=a.camera??{c2w:p,fov_y_deg:g};n.send(ig({...a,title:l.value,text:c.value,camera:h.checked?x:null,follows:d.checked}))})},tour(){const a=s(3,.1,600);Object.assign(a,{name:"stop",step:"any"});const l=n.store.now.state?.keys.length??0,c=l===0?"":`The ${l} keyframes of the path are replaced; undo has them.`,h=[e("Seconds at each hotspot",a),G("p",{class:"quiet"},c)];o("Tour of the hotspots as the camera path","Make the path",h,()=>n.send({type:"tour_path",stop:Number(a.value)}))},download(a){const l=n.store.now.hello?.splats===!0,c=l?YA:ng,h=a?lp:l?[...lp,...$A,...c]:c,d=G("select",{name:"form"},...h.map(([E,T])=>G("option",{value:E},T))),u=s(24,1,120);u.name="fps";const p=G("p",{class:"quiet"}),g=()=>{p.textContent=d.value.startsWith("usd")?"one file, its frames as time samples":"a .zip, a file for each frame"},x=s(1,1,1e9);Object.assign(x,{name:"splats",value:"",required:!1,placeholder:"all"});const m=s(1,1,1e9);Object.assign(m,{name:"budget",value:"",required:!1,placeholder:"all"});const f=e("At most so many splats",x),_=e("Splats held at a time",m);d.onchange=()=>{g(),f.hidden=[Fc,Er].includes(d.value),_.hidden=d.value!==Er},d.onchange(new Event("change"));const M=[e("File",d)];a?M.push(e("Frames per second",u),p):M.push(f,_),o(a?"Download the splats of each frame of the path":"Download the edited scene","Download",M,()=>{if(!a&&[Fc,Er].includes(d.value)){const E=d.value===Er,T=E&&m.value!==""?Number(m.value):null;n.send({type:"export_page",levels:E,budget:T});return}n.send({type:"export",form:d.value,along_path:a,fps:Number(u.value),splats:x.value===""?null:Number(x.value)})})},render(a){const l=a==="camera_path",c=(n.store.now.state?.path??"").replace(/\/+$/,""),h=i(l?`${c}.mp4`:`${c}-views`),{width:d,height:u}=n.viewport.points,p=[s(cp(d),16,4096),s(cp(u),16,4096)],g=s(24,1,120),x=r(),m=[e(l?"File":"Folder",h)];l&&m.push(e("Width",p[0]),e("Height",p[1]),e("Pictures per second",g)),m.push(e("Replace what is there",x)),o(l?"Render the camera path":"Render the test views","Render",m,()=>{n.send({type:"render",what:a,out:h.value,overwrite:x.checked,fps:Number(g.value),width:Number(p[0].value),height:Number(p[1].value)})})}}}function cp(n){return 2*Math.round(n/2)}const QA={continuous:"continuous",move:"move",copy:"copy",delete:"delete"},JA="Double-click the picture to put a pair of cages around what is there.";function tC(n,t,e){const i=G("ul",{class:"edits"}),s=G("p",{class:"empty"}),r=[],o=(...d)=>{const u=At(...d);return r.push(u),u},a=d=>t.withSelected(u=>{const p=n.store.now.state.edits.findIndex(g=>g.id===u.id);n.send({type:"reorder",edit:u.id,to:Math.max(0,p+d)})}),l=G("span",{class:"mirror"});for(const d of["x","y","z"]){const u=G("button",{type:"button",title:`Mirrored copy across ${d}`,onclick:()=>t.mirror(d)},d);r.push(u),l.append(u)}l.prepend(Zr(BA,16));const c=G("div",{class:"bar"},At(jm,"New edit in the middle of the view; or double-click the picture",()=>t.place(),"add"),At(rA,"New control point in the middle of the view; or Ctrl+double-click the picture",()=>t.placePoint(),"add-point"),At(aA,"Paste from another scene… (Shift+V)",()=>e.paste(),"paste-scene"),o(hA,"Duplicate (Ctrl+D)",()=>t.duplicate(),"duplicate"),l,o($m,"Earlier in the stack",()=>a(-1),"up"),o(sA,"Later in the stack",()=>a(1),"down"),G("span",{class:"space"}),o(Th,"Remove (Delete)",()=>t.removeSelected(),"remove"));let h=new Map;return n.store.watch(["hello"],d=>{s.textContent=Xe(d)?"There are no edits.":JA}),n.store.watch(["state"],({state:d})=>{const u=d?.edits??[];if(!(document.activeElement instanceof HTMLInputElement&&i.contains(document.activeElement))){const g=h;h=new Map(u.map((m,f)=>{const _=eC(m,f);return[_,g.get(_)??nC(n,m,f)]}));const x=[...h.values()];(x.length!==i.children.length||x.some((m,f)=>m!==i.children[f]))&&i.replaceChildren(...x),x.forEach((m,f)=>m.classList.toggle("chosen",u[f].id===d?.selected))}s.hidden=u.length>0;const p=xe(n.store.now)===null;for(const g of r)g.disabled=p}),cs("Edits",i,s,c)}function eC(n,t){return JSON.stringify([t,n.id,n.name,n.color,n.kind,n.enabled,n.locked,n.problem,n.source])}function nC(n,t,e){const i=l=>{n.send({type:"change",edit:t.id,...l})},s=G("span",{class:"swatch"});s.style.background=t.color;const r=G("span",{class:"name",title:"Double-click to rename"},t.name||`edit ${e+1}`);r.ondblclick=()=>!Xe(n.store.now)&&iC(r,t.name,l=>i({name:l}));const o=t.problem===null?null:G("span",{class:"problem",title:t.problem},Zr(HA,15)),a=G("li",{class:`edit${t.enabled?"":" off"}`,draggable:!0,data:{edit:String(t.id)}},s,r,o,G("span",{class:"kind",title:t.source===null?"":`from ${t.source}`},t.source===null?QA[t.kind]:"paste"),At(t.enabled?dA:uA,t.enabled?"Hide (H)":"Show (H)",()=>i({enabled:!t.enabled}),"eye"),At(t.locked?bA:xA,t.locked?"Unlock":"Lock",()=>i({locked:!t.locked}),"lock"));return a.onclick=l=>{l.target instanceof Element&&l.target.closest("button, input")===null&&n.send({type:"command",name:"select",edit:t.id})},a.ondragstart=l=>l.dataTransfer?.setData("application/x-edit",String(t.id)),a.ondragover=l=>l.preventDefault(),a.ondrop=l=>{const c=Number(l.dataTransfer?.getData("application/x-edit"));c>0&&c!==t.id&&n.send({type:"reorder",edit:c,to:e})},a}function iC(n,t,e){const i=G("input",{class:"rename",value:t,maxLength:200}),s=r=>{i.onblur=null,i.replaceWith(n),r&&i.value!==t&&e(i.value)};i.onblur=()=>s(!0),i.onkeydown=r=>{r.key==="Enter"&&s(!0),r.key==="Escape"&&s(!1)},n.replaceWith(i),i.focus(),i.select()}const sC=["Tools","Cages","Selection","Edits","View","Scene"];function rC(n,t){const e=({keys:r,action:o})=>G("div",{class:"binding"},G("span",{},...r.map(a=>G("kbd",{},a))),G("span",{},o)),i=sC.map(r=>G("div",{},G("h2",{},r),...t.filter(o=>o.group===r).map(e))),s=G("div",{class:"help",onclick:()=>n.store.set({help:!1})});return s.append(G("div",{class:"sheet"},...i,G("div",{},G("h2",{},"Mouse"),...IT.map(e)))),n.store.watch(["help"],r=>{s.hidden=!r.help}),s}function oC(n){const t=G("ol",{class:"history"});return n.store.watch(["state"],({state:e})=>{if(e===null)return;t.replaceChildren(...e.history.map((s,r)=>{const o=r===e.entry?" now":r>e.entry?" undone":"",a=()=>void n.send({type:"go_to",entry:r});return G("li",{class:`entry${o}`,onclick:a,data:{entry:String(r)}},s)}));const i=t.children[e.entry];i&&(t.scrollTop=i.offsetTop-t.offsetTop-t.clientHeight/2)}),cs("History",t)}const aC=.02,lC=3;class cC{constructor(t,e,i){this.app=t,this.dialogs=i;const s=At(Zm,"Place on the surface (Shift+H)",()=>e.toggleHotspots(),"place"),r=At(NA,"Tour as the camera path…",()=>i.tour(),"tour");this.panel=cs("Hotspots",G("div",{class:"bar"},s,r),this.list),t.store.watch(["state"],({state:o})=>{this.build(),r.disabled=!o?.hotspots.some(({hidden:a})=>!a)}),t.store.watch(["placesHotspot"],o=>s.classList.toggle("on",o.placesHotspot)),t.viewport.beforeFrame.push(()=>this.arrange())}panel;marks=G("div",{class:"hotspots"});list=G("ol",{class:"hotspot-list"});buttons=[];place(t,e){const{app:i}=this,s=uh(i.viewport,i.pictures,t,e);if(s===null)return i.say("nothing is there to mark; click on a surface","warning");const r={c2w:i.viewport.c2w,fov_y_deg:i.viewport.camera.fov},o=`Hotspot ${(i.store.now.state?.hotspots.length??0)+1}`;this.dialogs.hotspot({id:null,title:o,text:"",position:s,camera:r,follows:!0})}build(){const t=this.app.store.now.state?.hotspots??[];JSON.stringify(t)!==JSON.stringify(this.buttons.map(({hotspot:e})=>e))&&(this.list.replaceChildren(...t.map((e,i)=>this.row(e,i))),this.buttons=t.map((e,i)=>({hotspot:e,element:this.mark(e,i)})),this.marks.replaceChildren(...this.buttons.map(({element:e})=>e)),this.app.viewport.invalidate())}row(t,e){const{app:i}=this,s=t.hidden?"the edits hide its place":t.text,r=G("span",{class:"name",title:s},t.title);r.ondblclick=()=>!Xe(i.store.now)&&this.dialogs.hotspot(t);const o=l=>()=>{i.send({type:"move_hotspot",hotspot:t.id,to:l})},a=()=>{const l={c2w:i.viewport.c2w,fov_y_deg:i.viewport.camera.fov};i.send(ig({...t,camera:l}))};return G("li",{class:"row",data:{hotspot:String(t.id)}},G("span",{class:"number"},String(e+1)),r,At(Ym,"Look at it",()=>this.look(t),"go"),At(CA,"Title and text…",()=>this.dialogs.hotspot(t),"write"),At(Qm,"Take the view as it is now",a,"update"),At($m,"Earlier in the tour",o(Math.max(0,e-1)),"earlier"),At(Th,"Remove this hotspot",o(null),"drop"))}mark(t,e){const i=()=>Xe(this.app.store.now)?this.look(t):this.dialogs.hotspot(t),s=G("button",{type:"button",title:t.title,onclick:i},String(e+1));return s.hidden=!0,s}look({camera:t,position:e}){const{viewport:i,store:s}=this.app,{hello:r}=s.now;r!==null&&(t!==null?i.lookFrom(t.c2w,t.fov_y_deg,La(s.now),e):i.focus(e,.15*hp(e,i.camera.position.toArray())))}placeOf(t){return this.app.store.now.preview!==null?this.app.player.placeOf(t):t.hidden?null:t.position}arrange(){const{viewport:t,pictures:e,store:i}=this.app,{width:s,height:r}=t.points,o=t.camera.position.toArray(),a=lC*(i.now.hello?.voxel??0);for(const{hotspot:l,element:c}of this.buttons){const h=this.placeOf(l);if(c.hidden=!0,h===null)continue;const{x:d,y:u,depth:p}=t.project(h),g=p>0&&d>=0&&u>=0&&d<s&&u<r,x=hp(h,o),m=g?e.depth.at(d/s,u/r):null,f=m!==null&&m<x*(1-aC)-a;c.hidden=!g||f,c.hidden||(c.style.transform=`translate(${d}px, ${u}px)`)}}}function hp(n,t){return Math.hypot(...n.map((e,i)=>e-t[i]))}const hC={test_views:"Test views",camera_path:"Video",splats:"Splats",page:"Page"},uC=8e3;function dC(n){const t=G("div",{class:"jobs"});return n.store.watch(["jobs"],e=>{t.replaceChildren(...e.jobs.map(i=>fC(n,i)));for(const i of e.jobs.filter(s=>s.state!=="running"))setTimeout(()=>{n.store.set({jobs:n.store.now.jobs.filter(s=>s!==i)})},uC)}),t}function pC(n){const t=Mh(n);return n.state==="running"?t&&n.total===1?`writing ${n.out}`:`${n.done} of ${n.total}`:n.state==="done"?t?`${n.out} is ready`:`written to ${n.out}`:n.text||n.state}function fC(n,t){const e=G("progress",{max:Math.max(1,t.total)});(t.total>1||!Mh(t)||t.state!=="running")&&(e.value=t.done);const i=t.state==="running"?At(GA,"Cancel",()=>n.send({type:"cancel_job",job:t.job}),"cancel"):null;return G("div",{class:`job ${t.state}`},G("div",{class:"row"},G("strong",{},hC[t.what]),G("span",{class:"quiet",title:t.out},pC(t)),i),e)}/*! Tweakpane 4.0.5 (c) 2016 cocopon, licensed under the MIT license. */function ue(n){return n==null}function Ah(n){return n!==null&&typeof n=="object"}function kc(n){return n!==null&&typeof n=="object"}function mC(n,t){if(n.length!==t.length)return!1;for(let e=0;e<n.length;e++)if(n[e]!==t[e])return!1;return!0}function os(n,t){return Array.from(new Set([...Object.keys(n),...Object.keys(t)])).reduce((i,s)=>{const r=n[s],o=t[s];return kc(r)&&kc(o)?Object.assign(Object.assign({},i),{[s]:os(r,o)}):Object.assign(Object.assign({},i),{[s]:s in t?o:r})},{})}function Ch(n){return Ah(n)?"target"in n:!1}const gC={alreadydisposed:()=>"View has been already disposed",invalidparams:n=>`Invalid parameters for '${n.name}'`,nomatchingcontroller:n=>`No matching controller for '${n.key}'`,nomatchingview:n=>`No matching view for '${JSON.stringify(n.params)}'`,notbindable:()=>"Value is not bindable",notcompatible:n=>`Not compatible with  plugin '${n.id}'`,propertynotfound:n=>`Property '${n.name}' not found`,shouldneverhappen:()=>"This error should never happen"};class ye{static alreadyDisposed(){return new ye({type:"alreadydisposed"})}static notBindable(){return new ye({type:"notbindable"})}static notCompatible(t,e){return new ye({type:"notcompatible",context:{id:`${t}.${e}`}})}static propertyNotFound(t){return new ye({type:"propertynotfound",context:{name:t}})}static shouldNeverHappen(){return new ye({type:"shouldneverhappen"})}constructor(t){var e;this.message=(e=gC[t.type](t.context))!==null&&e!==void 0?e:"Unexpected error",this.name=this.constructor.name,this.stack=new Error(this.message).stack,this.type=t.type}toString(){return this.message}}class ya{constructor(t,e){this.obj_=t,this.key=e}static isBindable(t){return!(t===null||typeof t!="object"&&typeof t!="function")}read(){return this.obj_[this.key]}write(t){this.obj_[this.key]=t}writeProperty(t,e){const i=this.read();if(!ya.isBindable(i))throw ye.notBindable();if(!(t in i))throw ye.propertyNotFound(t);i[t]=e}}class Re{constructor(){this.observers_={}}on(t,e,i){var s;let r=this.observers_[t];return r||(r=this.observers_[t]=[]),r.push({handler:e,key:(s=i?.key)!==null&&s!==void 0?s:e}),this}off(t,e){const i=this.observers_[t];return i&&(this.observers_[t]=i.filter(s=>s.key!==e)),this}emit(t,e){const i=this.observers_[t];i&&i.forEach(s=>{s.handler(e)})}}class vC{constructor(t,e){var i;this.constraint_=e?.constraint,this.equals_=(i=e?.equals)!==null&&i!==void 0?i:((s,r)=>s===r),this.emitter=new Re,this.rawValue_=t}get constraint(){return this.constraint_}get rawValue(){return this.rawValue_}set rawValue(t){this.setRawValue(t,{forceEmit:!1,last:!0})}setRawValue(t,e){const i=e??{forceEmit:!1,last:!0},s=this.constraint_?this.constraint_.constrain(t):t,r=this.rawValue_;this.equals_(r,s)&&!i.forceEmit||(this.emitter.emit("beforechange",{sender:this}),this.rawValue_=s,this.emitter.emit("change",{options:i,previousRawValue:r,rawValue:s,sender:this}))}}class _C{constructor(t){this.emitter=new Re,this.value_=t}get rawValue(){return this.value_}set rawValue(t){this.setRawValue(t,{forceEmit:!1,last:!0})}setRawValue(t,e){const i=e??{forceEmit:!1,last:!0},s=this.value_;s===t&&!i.forceEmit||(this.emitter.emit("beforechange",{sender:this}),this.value_=t,this.emitter.emit("change",{options:i,previousRawValue:s,rawValue:this.value_,sender:this}))}}class xC{constructor(t){this.emitter=new Re,this.onValueBeforeChange_=this.onValueBeforeChange_.bind(this),this.onValueChange_=this.onValueChange_.bind(this),this.value_=t,this.value_.emitter.on("beforechange",this.onValueBeforeChange_),this.value_.emitter.on("change",this.onValueChange_)}get rawValue(){return this.value_.rawValue}onValueBeforeChange_(t){this.emitter.emit("beforechange",Object.assign(Object.assign({},t),{sender:this}))}onValueChange_(t){this.emitter.emit("change",Object.assign(Object.assign({},t),{sender:this}))}}function ge(n,t){const e=t?.constraint,i=t?.equals;return!e&&!i?new _C(n):new vC(n,t)}function bC(n){return[new xC(n),(t,e)=>{n.setRawValue(t,e)}]}class Vt{constructor(t){this.emitter=new Re,this.valMap_=t;for(const e in this.valMap_)this.valMap_[e].emitter.on("change",()=>{this.emitter.emit("change",{key:e,sender:this})})}static createCore(t){return Object.keys(t).reduce((i,s)=>Object.assign(i,{[s]:ge(t[s])}),{})}static fromObject(t){const e=this.createCore(t);return new Vt(e)}get(t){return this.valMap_[t].rawValue}set(t,e){this.valMap_[t].rawValue=e}value(t){return this.valMap_[t]}}class jr{constructor(t){this.values=Vt.fromObject({max:t.max,min:t.min})}constrain(t){const e=this.values.get("max"),i=this.values.get("min");return Math.min(Math.max(t,i),e)}}class wC{constructor(t){this.values=Vt.fromObject({max:t.max,min:t.min})}constrain(t){const e=this.values.get("max"),i=this.values.get("min");let s=t;return ue(i)||(s=Math.max(s,i)),ue(e)||(s=Math.min(s,e)),s}}class yC{constructor(t,e=0){this.step=t,this.origin=e}constrain(t){const e=this.origin%this.step,i=Math.round((t-e)/this.step);return e+i*this.step}}class SC{constructor(t){this.text=t}evaluate(){return Number(this.text)}toString(){return this.text}}const EC={"**":(n,t)=>Math.pow(n,t),"*":(n,t)=>n*t,"/":(n,t)=>n/t,"%":(n,t)=>n%t,"+":(n,t)=>n+t,"-":(n,t)=>n-t,"<<":(n,t)=>n<<t,">>":(n,t)=>n>>t,">>>":(n,t)=>n>>>t,"&":(n,t)=>n&t,"^":(n,t)=>n^t,"|":(n,t)=>n|t};class MC{constructor(t,e,i){this.left=e,this.operator=t,this.right=i}evaluate(){const t=EC[this.operator];if(!t)throw new Error(`unexpected binary operator: '${this.operator}`);return t(this.left.evaluate(),this.right.evaluate())}toString(){return["b(",this.left.toString(),this.operator,this.right.toString(),")"].join(" ")}}const TC={"+":n=>n,"-":n=>-n,"~":n=>~n};class AC{constructor(t,e){this.operator=t,this.expression=e}evaluate(){const t=TC[this.operator];if(!t)throw new Error(`unexpected unary operator: '${this.operator}`);return t(this.expression.evaluate())}toString(){return["u(",this.operator,this.expression.toString(),")"].join(" ")}}function Rh(n){return(t,e)=>{for(let i=0;i<n.length;i++){const s=n[i](t,e);if(s!=="")return s}return""}}function Br(n,t){var e;const i=n.substr(t).match(/^\s+/);return(e=i&&i[0])!==null&&e!==void 0?e:""}function CC(n,t){const e=n.substr(t,1);return e.match(/^[1-9]$/)?e:""}function zr(n,t){var e;const i=n.substr(t).match(/^[0-9]+/);return(e=i&&i[0])!==null&&e!==void 0?e:""}function RC(n,t){const e=zr(n,t);if(e!=="")return e;const i=n.substr(t,1);if(t+=1,i!=="-"&&i!=="+")return"";const s=zr(n,t);return s===""?"":i+s}function Ph(n,t){const e=n.substr(t,1);if(t+=1,e.toLowerCase()!=="e")return"";const i=RC(n,t);return i===""?"":e+i}function sg(n,t){const e=n.substr(t,1);if(e==="0")return e;const i=CC(n,t);return t+=i.length,i===""?"":i+zr(n,t)}function PC(n,t){const e=sg(n,t);if(t+=e.length,e==="")return"";const i=n.substr(t,1);if(t+=i.length,i!==".")return"";const s=zr(n,t);return t+=s.length,e+i+s+Ph(n,t)}function LC(n,t){const e=n.substr(t,1);if(t+=e.length,e!==".")return"";const i=zr(n,t);return t+=i.length,i===""?"":e+i+Ph(n,t)}function DC(n,t){const e=sg(n,t);return t+=e.length,e===""?"":e+Ph(n,t)}const IC=Rh([PC,LC,DC]);function NC(n,t){var e;const i=n.substr(t).match(/^[01]+/);return(e=i&&i[0])!==null&&e!==void 0?e:""}function UC(n,t){const e=n.substr(t,2);if(t+=e.length,e.toLowerCase()!=="0b")return"";const i=NC(n,t);return i===""?"":e+i}function OC(n,t){var e;const i=n.substr(t).match(/^[0-7]+/);return(e=i&&i[0])!==null&&e!==void 0?e:""}function FC(n,t){const e=n.substr(t,2);if(t+=e.length,e.toLowerCase()!=="0o")return"";const i=OC(n,t);return i===""?"":e+i}function kC(n,t){var e;const i=n.substr(t).match(/^[0-9a-f]+/i);return(e=i&&i[0])!==null&&e!==void 0?e:""}function BC(n,t){const e=n.substr(t,2);if(t+=e.length,e.toLowerCase()!=="0x")return"";const i=kC(n,t);return i===""?"":e+i}const zC=Rh([UC,FC,BC]),VC=Rh([zC,IC]);function HC(n,t){const e=VC(n,t);return t+=e.length,e===""?null:{evaluable:new SC(e),cursor:t}}function GC(n,t){const e=n.substr(t,1);if(t+=e.length,e!=="(")return null;const i=og(n,t);if(!i)return null;t=i.cursor,t+=Br(n,t).length;const s=n.substr(t,1);return t+=s.length,s!==")"?null:{evaluable:i.evaluable,cursor:t}}function WC(n,t){var e;return(e=HC(n,t))!==null&&e!==void 0?e:GC(n,t)}function rg(n,t){const e=WC(n,t);if(e)return e;const i=n.substr(t,1);if(t+=i.length,i!=="+"&&i!=="-"&&i!=="~")return null;const s=rg(n,t);return s?(t=s.cursor,{cursor:t,evaluable:new AC(i,s.evaluable)}):null}function XC(n,t,e){e+=Br(t,e).length;const i=n.filter(s=>t.startsWith(s,e))[0];return i?(e+=i.length,e+=Br(t,e).length,{cursor:e,operator:i}):null}function qC(n,t){return(e,i)=>{const s=n(e,i);if(!s)return null;i=s.cursor;let r=s.evaluable;for(;;){const o=XC(t,e,i);if(!o)break;i=o.cursor;const a=n(e,i);if(!a)return null;i=a.cursor,r=new MC(o.operator,r,a.evaluable)}return r?{cursor:i,evaluable:r}:null}}const $C=[["**"],["*","/","%"],["+","-"],["<<",">>>",">>"],["&"],["^"],["|"]].reduce((n,t)=>qC(n,t),rg);function og(n,t){return t+=Br(n,t).length,$C(n,t)}function YC(n){const t=og(n,0);return!t||t.cursor+Br(n,t.cursor).length!==n.length?null:t.evaluable}function gi(n){var t;const e=YC(n);return(t=e?.evaluate())!==null&&t!==void 0?t:null}function ag(n){if(typeof n=="number")return n;if(typeof n=="string"){const t=gi(n);if(!ue(t))return t}return 0}function KC(n){return String(n)}function ln(n){return t=>t.toFixed(Math.max(Math.min(n,20),0))}function ne(n,t,e,i,s){const r=(n-t)/(e-t);return i+r*(s-i)}function up(n){return String(n.toFixed(10)).split(".")[1].replace(/0+$/,"").length}function Ie(n,t,e){return Math.min(Math.max(n,t),e)}function lg(n,t){return(n%t+t)%t}function ZC(n,t){return ue(n.step)?Math.max(up(t),2):up(n.step)}function cg(n){var t;return(t=n.step)!==null&&t!==void 0?t:1}function hg(n,t){var e;const i=Math.abs((e=n.step)!==null&&e!==void 0?e:t);return i===0?.1:Math.pow(10,Math.floor(Math.log10(i))-1)}function ug(n,t){return ue(n.step)?null:new yC(n.step,t)}function dg(n){return!ue(n.max)&&!ue(n.min)?new jr({max:n.max,min:n.min}):!ue(n.max)||!ue(n.min)?new wC({max:n.max,min:n.min}):null}function pg(n,t){var e,i,s;return{formatter:(e=n.format)!==null&&e!==void 0?e:ln(ZC(n,t)),keyScale:(i=n.keyScale)!==null&&i!==void 0?i:cg(n),pointerScale:(s=n.pointerScale)!==null&&s!==void 0?s:hg(n,t)}}function fg(n){return{format:n.optional.function,keyScale:n.optional.number,max:n.optional.number,min:n.optional.number,pointerScale:n.optional.number,step:n.optional.number}}function Lh(n){return{constraint:n.constraint,textProps:Vt.fromObject(pg(n.params,n.initialValue))}}class hs{constructor(t){this.controller=t}get element(){return this.controller.view.element}get disabled(){return this.controller.viewProps.get("disabled")}set disabled(t){this.controller.viewProps.set("disabled",t)}get hidden(){return this.controller.viewProps.get("hidden")}set hidden(t){this.controller.viewProps.set("hidden",t)}dispose(){this.controller.viewProps.set("disposed",!0)}importState(t){return this.controller.importState(t)}exportState(){return this.controller.exportState()}}class Oa{constructor(t){this.target=t}}class Qr extends Oa{constructor(t,e,i){super(t),this.value=e,this.last=i??!0}}class jC extends Oa{constructor(t,e){super(t),this.expanded=e}}class QC extends Oa{constructor(t,e){super(t),this.index=e}}class JC extends Oa{constructor(t,e){super(t),this.native=e}}class Vr extends hs{constructor(t){super(t),this.onValueChange_=this.onValueChange_.bind(this),this.emitter_=new Re,this.controller.value.emitter.on("change",this.onValueChange_)}get label(){return this.controller.labelController.props.get("label")}set label(t){this.controller.labelController.props.set("label",t)}get key(){return this.controller.value.binding.target.key}get tag(){return this.controller.tag}set tag(t){this.controller.tag=t}on(t,e){const i=e.bind(this);return this.emitter_.on(t,s=>{i(s)},{key:e}),this}off(t,e){return this.emitter_.off(t,e),this}refresh(){this.controller.value.fetch()}onValueChange_(t){const e=this.controller.value;this.emitter_.emit("change",new Qr(this,e.binding.target.read(),t.options.last))}}class tR{constructor(t,e){this.onValueBeforeChange_=this.onValueBeforeChange_.bind(this),this.onValueChange_=this.onValueChange_.bind(this),this.binding=e,this.value_=t,this.value_.emitter.on("beforechange",this.onValueBeforeChange_),this.value_.emitter.on("change",this.onValueChange_),this.emitter=new Re}get rawValue(){return this.value_.rawValue}set rawValue(t){this.value_.rawValue=t}setRawValue(t,e){this.value_.setRawValue(t,e)}fetch(){this.value_.rawValue=this.binding.read()}push(){this.binding.write(this.value_.rawValue)}onValueBeforeChange_(t){this.emitter.emit("beforechange",Object.assign(Object.assign({},t),{sender:this}))}onValueChange_(t){this.push(),this.emitter.emit("change",Object.assign(Object.assign({},t),{sender:this}))}}function eR(n){if(!("binding"in n))return!1;const t=n.binding;return Ch(t)&&"read"in t&&"write"in t}function nR(n,t){const i=Object.keys(t).reduce((s,r)=>{if(s===void 0)return;const o=t[r],a=o(n[r]);return a.succeeded?Object.assign(Object.assign({},s),{[r]:a.value}):void 0},{});return i}function iR(n,t){return n.reduce((e,i)=>{if(e===void 0)return;const s=t(i);if(!(!s.succeeded||s.value===void 0))return[...e,s.value]},[])}function sR(n){return n===null?!1:typeof n=="object"}function ri(n){return t=>e=>{if(!t&&e===void 0)return{succeeded:!1,value:void 0};if(t&&e===void 0)return{succeeded:!0,value:void 0};const i=n(e);return i!==void 0?{succeeded:!0,value:i}:{succeeded:!1,value:void 0}}}function dp(n){return{custom:t=>ri(t)(n),boolean:ri(t=>typeof t=="boolean"?t:void 0)(n),number:ri(t=>typeof t=="number"?t:void 0)(n),string:ri(t=>typeof t=="string"?t:void 0)(n),function:ri(t=>typeof t=="function"?t:void 0)(n),constant:t=>ri(e=>e===t?t:void 0)(n),raw:ri(t=>t)(n),object:t=>ri(e=>{if(sR(e))return nR(e,t)})(n),array:t=>ri(e=>{if(Array.isArray(e))return iR(e,t)})(n)}}const Bc={optional:dp(!0),required:dp(!1)};function be(n,t){const e=t(Bc),i=Bc.required.object(e)(n);return i.succeeded?i.value:void 0}function pn(n,t,e,i){if(t&&!t(n))return!1;const s=be(n,e);return s?i(s):!1}function fn(n,t){var e;return os((e=n?.())!==null&&e!==void 0?e:{},t)}function es(n){return"value"in n}function mg(n){if(!Ah(n)||!("binding"in n))return!1;const t=n.binding;return Ch(t)}const qn="http://www.w3.org/2000/svg";function Sa(n){n.offsetHeight}function rR(n,t){const e=n.style.transition;n.style.transition="none",t(),n.style.transition=e}function Dh(n){return n.ontouchstart!==void 0}function oR(){return globalThis}function aR(){return oR().document}function lR(n){const t=n.ownerDocument.defaultView;return t&&"document"in t?n.getContext("2d",{willReadFrequently:!0}):null}const cR={check:'<path d="M2 8l4 4l8 -8"/>',dropdown:'<path d="M5 7h6l-3 3 z"/>',p2dpad:'<path d="M8 4v8"/><path d="M4 8h8"/><circle cx="12" cy="12" r="1.2"/>'};function Fa(n,t){const e=n.createElementNS(qn,"svg");return e.innerHTML=cR[t],e}function gg(n,t,e){n.insertBefore(t,n.children[e])}function Ih(n){n.parentElement&&n.parentElement.removeChild(n)}function vg(n){for(;n.children.length>0;)n.removeChild(n.children[0])}function hR(n){for(;n.childNodes.length>0;)n.removeChild(n.childNodes[0])}function _g(n){return n.relatedTarget?n.relatedTarget:"explicitOriginalTarget"in n?n.explicitOriginalTarget:null}function di(n,t){n.emitter.on("change",e=>{t(e.rawValue)}),t(n.rawValue)}function jn(n,t,e){di(n.value(t),e)}const uR="tp";function jt(n){return(e,i)=>[uR,"-",n,"v",e?`_${e}`:"",i?`-${i}`:""].join("")}const fr=jt("lbl");function dR(n,t){const e=n.createDocumentFragment();return t.split(`
`).map(s=>n.createTextNode(s)).forEach((s,r)=>{r>0&&e.appendChild(n.createElement("br")),e.appendChild(s)}),e}class xg{constructor(t,e){this.element=t.createElement("div"),this.element.classList.add(fr()),e.viewProps.bindClassModifiers(this.element);const i=t.createElement("div");i.classList.add(fr("l")),jn(e.props,"label",r=>{ue(r)?this.element.classList.add(fr(void 0,"nol")):(this.element.classList.remove(fr(void 0,"nol")),hR(i),i.appendChild(dR(t,r)))}),this.element.appendChild(i),this.labelElement=i;const s=t.createElement("div");s.classList.add(fr("v")),this.element.appendChild(s),this.valueElement=s}}class bg{constructor(t,e){this.props=e.props,this.valueController=e.valueController,this.viewProps=e.valueController.viewProps,this.view=new xg(t,{props:e.props,viewProps:this.viewProps}),this.view.valueElement.appendChild(this.valueController.view.element)}importProps(t){return pn(t,null,e=>({label:e.optional.string}),e=>(this.props.set("label",e.label),!0))}exportProps(){return fn(null,{label:this.props.get("label")})}}function pR(){return["veryfirst","first","last","verylast"]}const pp=jt(""),fp={veryfirst:"vfst",first:"fst",last:"lst",verylast:"vlst"};class ka{constructor(t){this.parent_=null,this.blade=t.blade,this.view=t.view,this.viewProps=t.viewProps;const e=this.view.element;this.blade.value("positions").emitter.on("change",()=>{pR().forEach(i=>{e.classList.remove(pp(void 0,fp[i]))}),this.blade.get("positions").forEach(i=>{e.classList.add(pp(void 0,fp[i]))})}),this.viewProps.handleDispose(()=>{Ih(e)})}get parent(){return this.parent_}set parent(t){this.parent_=t,this.viewProps.set("parent",this.parent_?this.parent_.viewProps:null)}importState(t){return pn(t,null,e=>({disabled:e.required.boolean,hidden:e.required.boolean}),e=>(this.viewProps.importState(e),!0))}exportState(){return fn(null,Object.assign({},this.viewProps.exportState()))}}class as extends ka{constructor(t,e){if(e.value!==e.valueController.value)throw ye.shouldNeverHappen();const i=e.valueController.viewProps,s=new bg(t,{blade:e.blade,props:e.props,valueController:e.valueController});super(Object.assign(Object.assign({},e),{view:new xg(t,{props:e.props,viewProps:i}),viewProps:i})),this.labelController=s,this.value=e.value,this.valueController=e.valueController,this.view.valueElement.appendChild(this.valueController.view.element)}importState(t){return pn(t,e=>{var i,s,r;return super.importState(e)&&this.labelController.importProps(e)&&((r=(s=(i=this.valueController).importProps)===null||s===void 0?void 0:s.call(i,t))!==null&&r!==void 0?r:!0)},e=>({value:e.optional.raw}),e=>(e.value&&(this.value.rawValue=e.value),!0))}exportState(){var t,e,i;return fn(()=>super.exportState(),Object.assign(Object.assign({value:this.value.rawValue},this.labelController.exportProps()),(i=(e=(t=this.valueController).exportProps)===null||e===void 0?void 0:e.call(t))!==null&&i!==void 0?i:{}))}}function mp(n){const t=Object.assign({},n);return delete t.value,t}class wg extends as{constructor(t,e){super(t,e),this.tag=e.tag}importState(t){return pn(t,e=>super.importState(mp(t)),e=>({tag:e.optional.string}),e=>(this.tag=e.tag,!0))}exportState(){return fn(()=>mp(super.exportState()),{binding:{key:this.value.binding.target.key,value:this.value.binding.target.read()},tag:this.tag})}}function fR(n){return es(n)&&mg(n.value)}class mR extends wg{importState(t){return pn(t,e=>super.importState(e),e=>({binding:e.required.object({value:e.required.raw})}),e=>(this.value.binding.inject(e.binding.value),this.value.fetch(),!0))}}function gR(n){return es(n)&&eR(n.value)}function yg(n,t){for(;n.length<t;)n.push(void 0)}function vR(n){const t=[];return yg(t,n),t}function _R(n){const t=n.indexOf(void 0);return t<0?n:n.slice(0,t)}function xR(n,t){const e=[..._R(n),t];return e.length>n.length?e.splice(0,e.length-n.length):yg(e,n.length),e}class bR{constructor(t){this.emitter=new Re,this.onTick_=this.onTick_.bind(this),this.onValueBeforeChange_=this.onValueBeforeChange_.bind(this),this.onValueChange_=this.onValueChange_.bind(this),this.binding=t.binding,this.value_=ge(vR(t.bufferSize)),this.value_.emitter.on("beforechange",this.onValueBeforeChange_),this.value_.emitter.on("change",this.onValueChange_),this.ticker=t.ticker,this.ticker.emitter.on("tick",this.onTick_),this.fetch()}get rawValue(){return this.value_.rawValue}set rawValue(t){this.value_.rawValue=t}setRawValue(t,e){this.value_.setRawValue(t,e)}fetch(){this.value_.rawValue=xR(this.value_.rawValue,this.binding.read())}onTick_(){this.fetch()}onValueBeforeChange_(t){this.emitter.emit("beforechange",Object.assign(Object.assign({},t),{sender:this}))}onValueChange_(t){this.emitter.emit("change",Object.assign(Object.assign({},t),{sender:this}))}}function wR(n){if(!("binding"in n))return!1;const t=n.binding;return Ch(t)&&"read"in t&&!("write"in t)}class yR extends wg{exportState(){return fn(()=>super.exportState(),{binding:{readonly:!0}})}}function SR(n){return es(n)&&wR(n.value)}class ER extends hs{get label(){return this.controller.labelController.props.get("label")}set label(t){this.controller.labelController.props.set("label",t)}get title(){var t;return(t=this.controller.buttonController.props.get("title"))!==null&&t!==void 0?t:""}set title(t){this.controller.buttonController.props.set("title",t)}on(t,e){const i=e.bind(this);return this.controller.buttonController.emitter.on(t,r=>{i(new JC(this,r.nativeEvent))}),this}off(t,e){return this.controller.buttonController.emitter.off(t,e),this}}function MR(n,t,e){e?n.classList.add(t):n.classList.remove(t)}function tr(n,t){return e=>{MR(n,t,e)}}function Nh(n,t){di(n,e=>{t.textContent=e??""})}const Rl=jt("btn");class TR{constructor(t,e){this.element=t.createElement("div"),this.element.classList.add(Rl()),e.viewProps.bindClassModifiers(this.element);const i=t.createElement("button");i.classList.add(Rl("b")),e.viewProps.bindDisabled(i),this.element.appendChild(i),this.buttonElement=i;const s=t.createElement("div");s.classList.add(Rl("t")),Nh(e.props.value("title"),s),this.buttonElement.appendChild(s)}}class AR{constructor(t,e){this.emitter=new Re,this.onClick_=this.onClick_.bind(this),this.props=e.props,this.viewProps=e.viewProps,this.view=new TR(t,{props:this.props,viewProps:this.viewProps}),this.view.buttonElement.addEventListener("click",this.onClick_)}importProps(t){return pn(t,null,e=>({title:e.optional.string}),e=>(this.props.set("title",e.title),!0))}exportProps(){return fn(null,{title:this.props.get("title")})}onClick_(t){this.emitter.emit("click",{nativeEvent:t,sender:this})}}class gp extends ka{constructor(t,e){const i=new AR(t,{props:e.buttonProps,viewProps:e.viewProps}),s=new bg(t,{blade:e.blade,props:e.labelProps,valueController:i});super({blade:e.blade,view:s.view,viewProps:e.viewProps}),this.buttonController=i,this.labelController=s}importState(t){return pn(t,e=>super.importState(e)&&this.buttonController.importProps(e)&&this.labelController.importProps(e),()=>({}),()=>!0)}exportState(){return fn(()=>super.exportState(),Object.assign(Object.assign({},this.buttonController.exportProps()),this.labelController.exportProps()))}}class Sg{constructor(t){const[e,i]=t.split("-"),s=e.split(".");this.major=parseInt(s[0],10),this.minor=parseInt(s[1],10),this.patch=parseInt(s[2],10),this.prerelease=i??null}toString(){const t=[this.major,this.minor,this.patch].join(".");return this.prerelease!==null?[t,this.prerelease].join("-"):t}}const er=new Sg("2.0.5");function nn(n){return Object.assign({core:er},n)}const CR=nn({id:"button",type:"blade",accept(n){const t=be(n,e=>({title:e.required.string,view:e.required.constant("button"),label:e.optional.string}));return t?{params:t}:null},controller(n){return new gp(n.document,{blade:n.blade,buttonProps:Vt.fromObject({title:n.params.title}),labelProps:Vt.fromObject({label:n.params.label}),viewProps:n.viewProps})},api(n){return n.controller instanceof gp?new ER(n.controller):null}});function RR(n,t){return n.addBlade(Object.assign(Object.assign({},t),{view:"button"}))}function PR(n,t){return n.addBlade(Object.assign(Object.assign({},t),{view:"folder"}))}function LR(n,t){return n.addBlade(Object.assign(Object.assign({},t),{view:"tab"}))}function DR(n){return Ah(n)?"refresh"in n&&typeof n.refresh=="function":!1}function IR(n,t){if(!ya.isBindable(n))throw ye.notBindable();return new ya(n,t)}class NR{constructor(t,e){this.onRackValueChange_=this.onRackValueChange_.bind(this),this.controller_=t,this.emitter_=new Re,this.pool_=e,this.controller_.rack.emitter.on("valuechange",this.onRackValueChange_)}get children(){return this.controller_.rack.children.map(t=>this.pool_.createApi(t))}addBinding(t,e,i){const s=i??{},r=this.controller_.element.ownerDocument,o=this.pool_.createBinding(r,IR(t,e),s),a=this.pool_.createBindingApi(o);return this.add(a,s.index)}addFolder(t){return PR(this,t)}addButton(t){return RR(this,t)}addTab(t){return LR(this,t)}add(t,e){const i=t.controller;return this.controller_.rack.add(i,e),t}remove(t){this.controller_.rack.remove(t.controller)}addBlade(t){const e=this.controller_.element.ownerDocument,i=this.pool_.createBlade(e,t),s=this.pool_.createApi(i);return this.add(s,t.index)}on(t,e){const i=e.bind(this);return this.emitter_.on(t,s=>{i(s)},{key:e}),this}off(t,e){return this.emitter_.off(t,e),this}refresh(){this.children.forEach(t=>{DR(t)&&t.refresh()})}onRackValueChange_(t){const e=t.bladeController,i=this.pool_.createApi(e),s=mg(e.value)?e.value.binding:null;this.emitter_.emit("change",new Qr(i,s?s.target.read():e.value.rawValue,t.options.last))}}class Uh extends hs{constructor(t,e){super(t),this.rackApi_=new NR(t.rackController,e)}refresh(){this.rackApi_.refresh()}}class Oh extends ka{constructor(t){super({blade:t.blade,view:t.view,viewProps:t.rackController.viewProps}),this.rackController=t.rackController}importState(t){return pn(t,e=>super.importState(e),e=>({children:e.required.array(e.required.raw)}),e=>this.rackController.rack.children.every((i,s)=>i.importState(e.children[s])))}exportState(){return fn(()=>super.exportState(),{children:this.rackController.rack.children.map(t=>t.exportState())})}}function zc(n){return"rackController"in n}class UR{constructor(t){this.emitter=new Re,this.items_=[],this.cache_=new Set,this.onSubListAdd_=this.onSubListAdd_.bind(this),this.onSubListRemove_=this.onSubListRemove_.bind(this),this.extract_=t}get items(){return this.items_}allItems(){return Array.from(this.cache_)}find(t){for(const e of this.allItems())if(t(e))return e;return null}includes(t){return this.cache_.has(t)}add(t,e){if(this.includes(t))throw ye.shouldNeverHappen();const i=e!==void 0?e:this.items_.length;this.items_.splice(i,0,t),this.cache_.add(t);const s=this.extract_(t);s&&(s.emitter.on("add",this.onSubListAdd_),s.emitter.on("remove",this.onSubListRemove_),s.allItems().forEach(r=>{this.cache_.add(r)})),this.emitter.emit("add",{index:i,item:t,root:this,target:this})}remove(t){const e=this.items_.indexOf(t);if(e<0)return;this.items_.splice(e,1),this.cache_.delete(t);const i=this.extract_(t);i&&(i.allItems().forEach(s=>{this.cache_.delete(s)}),i.emitter.off("add",this.onSubListAdd_),i.emitter.off("remove",this.onSubListRemove_)),this.emitter.emit("remove",{index:e,item:t,root:this,target:this})}onSubListAdd_(t){this.cache_.add(t.item),this.emitter.emit("add",{index:t.index,item:t.item,root:this,target:t.target})}onSubListRemove_(t){this.cache_.delete(t.item),this.emitter.emit("remove",{index:t.index,item:t.item,root:this,target:t.target})}}function OR(n,t){for(let e=0;e<n.length;e++){const i=n[e];if(es(i)&&i.value===t)return i}return null}function FR(n){return zc(n)?n.rackController.rack.bcSet_:null}class kR{constructor(t){var e,i;this.emitter=new Re,this.onBladePositionsChange_=this.onBladePositionsChange_.bind(this),this.onSetAdd_=this.onSetAdd_.bind(this),this.onSetRemove_=this.onSetRemove_.bind(this),this.onChildDispose_=this.onChildDispose_.bind(this),this.onChildPositionsChange_=this.onChildPositionsChange_.bind(this),this.onChildValueChange_=this.onChildValueChange_.bind(this),this.onChildViewPropsChange_=this.onChildViewPropsChange_.bind(this),this.onRackLayout_=this.onRackLayout_.bind(this),this.onRackValueChange_=this.onRackValueChange_.bind(this),this.blade_=(e=t.blade)!==null&&e!==void 0?e:null,(i=this.blade_)===null||i===void 0||i.value("positions").emitter.on("change",this.onBladePositionsChange_),this.viewProps=t.viewProps,this.bcSet_=new UR(FR),this.bcSet_.emitter.on("add",this.onSetAdd_),this.bcSet_.emitter.on("remove",this.onSetRemove_)}get children(){return this.bcSet_.items}add(t,e){var i;(i=t.parent)===null||i===void 0||i.remove(t),t.parent=this,this.bcSet_.add(t,e)}remove(t){t.parent=null,this.bcSet_.remove(t)}find(t){return this.bcSet_.allItems().filter(t)}onSetAdd_(t){this.updatePositions_();const e=t.target===t.root;if(this.emitter.emit("add",{bladeController:t.item,index:t.index,root:e,sender:this}),!e)return;const i=t.item;if(i.viewProps.emitter.on("change",this.onChildViewPropsChange_),i.blade.value("positions").emitter.on("change",this.onChildPositionsChange_),i.viewProps.handleDispose(this.onChildDispose_),es(i))i.value.emitter.on("change",this.onChildValueChange_);else if(zc(i)){const s=i.rackController.rack;if(s){const r=s.emitter;r.on("layout",this.onRackLayout_),r.on("valuechange",this.onRackValueChange_)}}}onSetRemove_(t){this.updatePositions_();const e=t.target===t.root;if(this.emitter.emit("remove",{bladeController:t.item,root:e,sender:this}),!e)return;const i=t.item;if(es(i))i.value.emitter.off("change",this.onChildValueChange_);else if(zc(i)){const s=i.rackController.rack;if(s){const r=s.emitter;r.off("layout",this.onRackLayout_),r.off("valuechange",this.onRackValueChange_)}}}updatePositions_(){const t=this.bcSet_.items.filter(s=>!s.viewProps.get("hidden")),e=t[0],i=t[t.length-1];this.bcSet_.items.forEach(s=>{const r=[];s===e&&(r.push("first"),(!this.blade_||this.blade_.get("positions").includes("veryfirst"))&&r.push("veryfirst")),s===i&&(r.push("last"),(!this.blade_||this.blade_.get("positions").includes("verylast"))&&r.push("verylast")),s.blade.set("positions",r)})}onChildPositionsChange_(){this.updatePositions_(),this.emitter.emit("layout",{sender:this})}onChildViewPropsChange_(t){this.updatePositions_(),this.emitter.emit("layout",{sender:this})}onChildDispose_(){this.bcSet_.items.filter(e=>e.viewProps.get("disposed")).forEach(e=>{this.bcSet_.remove(e)})}onChildValueChange_(t){const e=OR(this.find(es),t.sender);if(!e)throw ye.alreadyDisposed();this.emitter.emit("valuechange",{bladeController:e,options:t.options,sender:this})}onRackLayout_(t){this.updatePositions_(),this.emitter.emit("layout",{sender:this})}onRackValueChange_(t){this.emitter.emit("valuechange",{bladeController:t.bladeController,options:t.options,sender:this})}onBladePositionsChange_(){this.updatePositions_()}}class Fh{constructor(t){this.onRackAdd_=this.onRackAdd_.bind(this),this.onRackRemove_=this.onRackRemove_.bind(this),this.element=t.element,this.viewProps=t.viewProps;const e=new kR({blade:t.root?void 0:t.blade,viewProps:t.viewProps});e.emitter.on("add",this.onRackAdd_),e.emitter.on("remove",this.onRackRemove_),this.rack=e,this.viewProps.handleDispose(()=>{for(let i=this.rack.children.length-1;i>=0;i--)this.rack.children[i].viewProps.set("disposed",!0)})}onRackAdd_(t){t.root&&gg(this.element,t.bladeController.view.element,t.index)}onRackRemove_(t){t.root&&Ih(t.bladeController.view.element)}}function nr(){return new Vt({positions:ge([],{equals:mC})})}class Jr extends Vt{constructor(t){super(t)}static create(t){const e={completed:!0,expanded:t,expandedHeight:null,shouldFixHeight:!1,temporaryExpanded:null},i=Vt.createCore(e);return new Jr(i)}get styleExpanded(){var t;return(t=this.get("temporaryExpanded"))!==null&&t!==void 0?t:this.get("expanded")}get styleHeight(){if(!this.styleExpanded)return"0";const t=this.get("expandedHeight");return this.get("shouldFixHeight")&&!ue(t)?`${t}px`:"auto"}bindExpandedClass(t,e){const i=()=>{this.styleExpanded?t.classList.add(e):t.classList.remove(e)};jn(this,"expanded",i),jn(this,"temporaryExpanded",i)}cleanUpTransition(){this.set("shouldFixHeight",!1),this.set("expandedHeight",null),this.set("completed",!0)}}function BR(n,t){let e=0;return rR(t,()=>{n.set("expandedHeight",null),n.set("temporaryExpanded",!0),Sa(t),e=t.clientHeight,n.set("temporaryExpanded",null),Sa(t)}),e}function vp(n,t){t.style.height=n.styleHeight}function kh(n,t){n.value("expanded").emitter.on("beforechange",()=>{if(n.set("completed",!1),ue(n.get("expandedHeight"))){const e=BR(n,t);e>0&&n.set("expandedHeight",e)}n.set("shouldFixHeight",!0),Sa(t)}),n.emitter.on("change",()=>{vp(n,t)}),vp(n,t),t.addEventListener("transitionend",e=>{e.propertyName==="height"&&n.cleanUpTransition()})}class Eg extends Uh{constructor(t,e){super(t,e),this.emitter_=new Re,this.controller.foldable.value("expanded").emitter.on("change",i=>{this.emitter_.emit("fold",new jC(this,i.sender.rawValue))}),this.rackApi_.on("change",i=>{this.emitter_.emit("change",i)})}get expanded(){return this.controller.foldable.get("expanded")}set expanded(t){this.controller.foldable.set("expanded",t)}get title(){return this.controller.props.get("title")}set title(t){this.controller.props.set("title",t)}get children(){return this.rackApi_.children}addBinding(t,e,i){return this.rackApi_.addBinding(t,e,i)}addFolder(t){return this.rackApi_.addFolder(t)}addButton(t){return this.rackApi_.addButton(t)}addTab(t){return this.rackApi_.addTab(t)}add(t,e){return this.rackApi_.add(t,e)}remove(t){this.rackApi_.remove(t)}addBlade(t){return this.rackApi_.addBlade(t)}on(t,e){const i=e.bind(this);return this.emitter_.on(t,s=>{i(s)},{key:e}),this}off(t,e){return this.emitter_.off(t,e),this}}const Mg=jt("cnt");class zR{constructor(t,e){var i;this.className_=jt((i=e.viewName)!==null&&i!==void 0?i:"fld"),this.element=t.createElement("div"),this.element.classList.add(this.className_(),Mg()),e.viewProps.bindClassModifiers(this.element),this.foldable_=e.foldable,this.foldable_.bindExpandedClass(this.element,this.className_(void 0,"expanded")),jn(this.foldable_,"completed",tr(this.element,this.className_(void 0,"cpl")));const s=t.createElement("button");s.classList.add(this.className_("b")),jn(e.props,"title",c=>{ue(c)?this.element.classList.add(this.className_(void 0,"not")):this.element.classList.remove(this.className_(void 0,"not"))}),e.viewProps.bindDisabled(s),this.element.appendChild(s),this.buttonElement=s;const r=t.createElement("div");r.classList.add(this.className_("i")),this.element.appendChild(r);const o=t.createElement("div");o.classList.add(this.className_("t")),Nh(e.props.value("title"),o),this.buttonElement.appendChild(o),this.titleElement=o;const a=t.createElement("div");a.classList.add(this.className_("m")),this.buttonElement.appendChild(a);const l=t.createElement("div");l.classList.add(this.className_("c")),this.element.appendChild(l),this.containerElement=l}}class Vc extends Oh{constructor(t,e){var i;const s=Jr.create((i=e.expanded)!==null&&i!==void 0?i:!0),r=new zR(t,{foldable:s,props:e.props,viewName:e.root?"rot":void 0,viewProps:e.viewProps});super(Object.assign(Object.assign({},e),{rackController:new Fh({blade:e.blade,element:r.containerElement,root:e.root,viewProps:e.viewProps}),view:r})),this.onTitleClick_=this.onTitleClick_.bind(this),this.props=e.props,this.foldable=s,kh(this.foldable,this.view.containerElement),this.rackController.rack.emitter.on("add",()=>{this.foldable.cleanUpTransition()}),this.rackController.rack.emitter.on("remove",()=>{this.foldable.cleanUpTransition()}),this.view.buttonElement.addEventListener("click",this.onTitleClick_)}get document(){return this.view.element.ownerDocument}importState(t){return pn(t,e=>super.importState(e),e=>({expanded:e.required.boolean,title:e.optional.string}),e=>(this.foldable.set("expanded",e.expanded),this.props.set("title",e.title),!0))}exportState(){return fn(()=>super.exportState(),{expanded:this.foldable.get("expanded"),title:this.props.get("title")})}onTitleClick_(){this.foldable.set("expanded",!this.foldable.get("expanded"))}}const VR=nn({id:"folder",type:"blade",accept(n){const t=be(n,e=>({title:e.required.string,view:e.required.constant("folder"),expanded:e.optional.boolean}));return t?{params:t}:null},controller(n){return new Vc(n.document,{blade:n.blade,expanded:n.params.expanded,props:Vt.fromObject({title:n.params.title}),viewProps:n.viewProps})},api(n){return n.controller instanceof Vc?new Eg(n.controller,n.pool):null}}),HR=jt("");function _p(n,t){return tr(n,HR(void 0,t))}class xi extends Vt{constructor(t){var e;super(t),this.onDisabledChange_=this.onDisabledChange_.bind(this),this.onParentChange_=this.onParentChange_.bind(this),this.onParentGlobalDisabledChange_=this.onParentGlobalDisabledChange_.bind(this),[this.globalDisabled_,this.setGlobalDisabled_]=bC(ge(this.getGlobalDisabled_())),this.value("disabled").emitter.on("change",this.onDisabledChange_),this.value("parent").emitter.on("change",this.onParentChange_),(e=this.get("parent"))===null||e===void 0||e.globalDisabled.emitter.on("change",this.onParentGlobalDisabledChange_)}static create(t){var e,i,s;const r=t??{};return new xi(Vt.createCore({disabled:(e=r.disabled)!==null&&e!==void 0?e:!1,disposed:!1,hidden:(i=r.hidden)!==null&&i!==void 0?i:!1,parent:(s=r.parent)!==null&&s!==void 0?s:null}))}get globalDisabled(){return this.globalDisabled_}bindClassModifiers(t){di(this.globalDisabled_,_p(t,"disabled")),jn(this,"hidden",_p(t,"hidden"))}bindDisabled(t){di(this.globalDisabled_,e=>{t.disabled=e})}bindTabIndex(t){di(this.globalDisabled_,e=>{t.tabIndex=e?-1:0})}handleDispose(t){this.value("disposed").emitter.on("change",e=>{e&&t()})}importState(t){this.set("disabled",t.disabled),this.set("hidden",t.hidden)}exportState(){return{disabled:this.get("disabled"),hidden:this.get("hidden")}}getGlobalDisabled_(){const t=this.get("parent");return(t?t.globalDisabled.rawValue:!1)||this.get("disabled")}updateGlobalDisabled_(){this.setGlobalDisabled_(this.getGlobalDisabled_())}onDisabledChange_(){this.updateGlobalDisabled_()}onParentGlobalDisabledChange_(){this.updateGlobalDisabled_()}onParentChange_(t){var e;const i=t.previousRawValue;i?.globalDisabled.emitter.off("change",this.onParentGlobalDisabledChange_),(e=this.get("parent"))===null||e===void 0||e.globalDisabled.emitter.on("change",this.onParentGlobalDisabledChange_),this.updateGlobalDisabled_()}}const xp=jt("tbp");class GR{constructor(t,e){this.element=t.createElement("div"),this.element.classList.add(xp()),e.viewProps.bindClassModifiers(this.element);const i=t.createElement("div");i.classList.add(xp("c")),this.element.appendChild(i),this.containerElement=i}}const mr=jt("tbi");class WR{constructor(t,e){this.element=t.createElement("div"),this.element.classList.add(mr()),e.viewProps.bindClassModifiers(this.element),jn(e.props,"selected",r=>{r?this.element.classList.add(mr(void 0,"sel")):this.element.classList.remove(mr(void 0,"sel"))});const i=t.createElement("button");i.classList.add(mr("b")),e.viewProps.bindDisabled(i),this.element.appendChild(i),this.buttonElement=i;const s=t.createElement("div");s.classList.add(mr("t")),Nh(e.props.value("title"),s),this.buttonElement.appendChild(s),this.titleElement=s}}class XR{constructor(t,e){this.emitter=new Re,this.onClick_=this.onClick_.bind(this),this.props=e.props,this.viewProps=e.viewProps,this.view=new WR(t,{props:e.props,viewProps:e.viewProps}),this.view.buttonElement.addEventListener("click",this.onClick_)}onClick_(){this.emitter.emit("click",{sender:this})}}class Hc extends Oh{constructor(t,e){const i=new GR(t,{viewProps:e.viewProps});super(Object.assign(Object.assign({},e),{rackController:new Fh({blade:e.blade,element:i.containerElement,viewProps:e.viewProps}),view:i})),this.onItemClick_=this.onItemClick_.bind(this),this.ic_=new XR(t,{props:e.itemProps,viewProps:xi.create()}),this.ic_.emitter.on("click",this.onItemClick_),this.props=e.props,jn(this.props,"selected",s=>{this.itemController.props.set("selected",s),this.viewProps.set("hidden",!s)})}get itemController(){return this.ic_}importState(t){return pn(t,e=>super.importState(e),e=>({selected:e.required.boolean,title:e.required.string}),e=>(this.ic_.props.set("selected",e.selected),this.ic_.props.set("title",e.title),!0))}exportState(){return fn(()=>super.exportState(),{selected:this.ic_.props.get("selected"),title:this.ic_.props.get("title")})}onItemClick_(){this.props.set("selected",!0)}}class qR extends Uh{constructor(t,e){super(t,e),this.emitter_=new Re,this.onSelect_=this.onSelect_.bind(this),this.pool_=e,this.rackApi_.on("change",i=>{this.emitter_.emit("change",i)}),this.controller.tab.selectedIndex.emitter.on("change",this.onSelect_)}get pages(){return this.rackApi_.children}addPage(t){const e=this.controller.view.element.ownerDocument,i=new Hc(e,{blade:nr(),itemProps:Vt.fromObject({selected:!1,title:t.title}),props:Vt.fromObject({selected:!1}),viewProps:xi.create()}),s=this.pool_.createApi(i);return this.rackApi_.add(s,t.index)}removePage(t){this.rackApi_.remove(this.rackApi_.children[t])}on(t,e){const i=e.bind(this);return this.emitter_.on(t,s=>{i(s)},{key:e}),this}off(t,e){return this.emitter_.off(t,e),this}onSelect_(t){this.emitter_.emit("select",new QC(this,t.rawValue))}}class $R extends Uh{get title(){var t;return(t=this.controller.itemController.props.get("title"))!==null&&t!==void 0?t:""}set title(t){this.controller.itemController.props.set("title",t)}get selected(){return this.controller.props.get("selected")}set selected(t){this.controller.props.set("selected",t)}get children(){return this.rackApi_.children}addButton(t){return this.rackApi_.addButton(t)}addFolder(t){return this.rackApi_.addFolder(t)}addTab(t){return this.rackApi_.addTab(t)}add(t,e){this.rackApi_.add(t,e)}remove(t){this.rackApi_.remove(t)}addBinding(t,e,i){return this.rackApi_.addBinding(t,e,i)}addBlade(t){return this.rackApi_.addBlade(t)}}const bp=-1;class YR{constructor(){this.onItemSelectedChange_=this.onItemSelectedChange_.bind(this),this.empty=ge(!0),this.selectedIndex=ge(bp),this.items_=[]}add(t,e){const i=e??this.items_.length;this.items_.splice(i,0,t),t.emitter.on("change",this.onItemSelectedChange_),this.keepSelection_()}remove(t){const e=this.items_.indexOf(t);e<0||(this.items_.splice(e,1),t.emitter.off("change",this.onItemSelectedChange_),this.keepSelection_())}keepSelection_(){if(this.items_.length===0){this.selectedIndex.rawValue=bp,this.empty.rawValue=!0;return}const t=this.items_.findIndex(e=>e.rawValue);t<0?(this.items_.forEach((e,i)=>{e.rawValue=i===0}),this.selectedIndex.rawValue=0):(this.items_.forEach((e,i)=>{e.rawValue=i===t}),this.selectedIndex.rawValue=t),this.empty.rawValue=!1}onItemSelectedChange_(t){if(t.rawValue){const e=this.items_.findIndex(i=>i===t.sender);this.items_.forEach((i,s)=>{i.rawValue=s===e}),this.selectedIndex.rawValue=e}else this.keepSelection_()}}const gr=jt("tab");class KR{constructor(t,e){this.element=t.createElement("div"),this.element.classList.add(gr(),Mg()),e.viewProps.bindClassModifiers(this.element),di(e.empty,tr(this.element,gr(void 0,"nop")));const i=t.createElement("div");i.classList.add(gr("t")),this.element.appendChild(i),this.itemsElement=i;const s=t.createElement("div");s.classList.add(gr("i")),this.element.appendChild(s);const r=t.createElement("div");r.classList.add(gr("c")),this.element.appendChild(r),this.contentsElement=r}}class wp extends Oh{constructor(t,e){const i=new YR,s=new KR(t,{empty:i.empty,viewProps:e.viewProps});super({blade:e.blade,rackController:new Fh({blade:e.blade,element:s.contentsElement,viewProps:e.viewProps}),view:s}),this.onRackAdd_=this.onRackAdd_.bind(this),this.onRackRemove_=this.onRackRemove_.bind(this);const r=this.rackController.rack;r.emitter.on("add",this.onRackAdd_),r.emitter.on("remove",this.onRackRemove_),this.tab=i}add(t,e){this.rackController.rack.add(t,e)}remove(t){this.rackController.rack.remove(this.rackController.rack.children[t])}onRackAdd_(t){if(!t.root)return;const e=t.bladeController;gg(this.view.itemsElement,e.itemController.view.element,t.index),e.itemController.viewProps.set("parent",this.viewProps),this.tab.add(e.props.value("selected"))}onRackRemove_(t){if(!t.root)return;const e=t.bladeController;Ih(e.itemController.view.element),e.itemController.viewProps.set("parent",null),this.tab.remove(e.props.value("selected"))}}const Tg=nn({id:"tab",type:"blade",accept(n){const t=be(n,e=>({pages:e.required.array(e.required.object({title:e.required.string})),view:e.required.constant("tab")}));return!t||t.pages.length===0?null:{params:t}},controller(n){const t=new wp(n.document,{blade:n.blade,viewProps:n.viewProps});return n.params.pages.forEach(e=>{const i=new Hc(n.document,{blade:nr(),itemProps:Vt.fromObject({selected:!1,title:e.title}),props:Vt.fromObject({selected:!1}),viewProps:xi.create()});t.add(i)}),t},api(n){return n.controller instanceof wp?new qR(n.controller,n.pool):n.controller instanceof Hc?new $R(n.controller,n.pool):null}});function ZR(n,t){const e=n.accept(t.params);if(!e)return null;const i=be(t.params,s=>({disabled:s.optional.boolean,hidden:s.optional.boolean}));return n.controller({blade:nr(),document:t.document,params:Object.assign(Object.assign({},e.params),{disabled:i?.disabled,hidden:i?.hidden}),viewProps:xi.create({disabled:i?.disabled,hidden:i?.hidden})})}class Bh extends Vr{get options(){return this.controller.valueController.props.get("options")}set options(t){this.controller.valueController.props.set("options",t)}}class jR{constructor(){this.disabled=!1,this.emitter=new Re}dispose(){}tick(){this.disabled||this.emitter.emit("tick",{sender:this})}}class QR{constructor(t,e){this.disabled_=!1,this.timerId_=null,this.onTick_=this.onTick_.bind(this),this.doc_=t,this.emitter=new Re,this.interval_=e,this.setTimer_()}get disabled(){return this.disabled_}set disabled(t){this.disabled_=t,this.disabled_?this.clearTimer_():this.setTimer_()}dispose(){this.clearTimer_()}clearTimer_(){if(this.timerId_===null)return;const t=this.doc_.defaultView;t&&t.clearInterval(this.timerId_),this.timerId_=null}setTimer_(){if(this.clearTimer_(),this.interval_<=0)return;const t=this.doc_.defaultView;t&&(this.timerId_=t.setInterval(this.onTick_,this.interval_))}onTick_(){this.disabled_||this.emitter.emit("tick",{sender:this})}}class to{constructor(t){this.constraints=t}constrain(t){return this.constraints.reduce((e,i)=>i.constrain(e),t)}}function Ea(n,t){if(n instanceof t)return n;if(n instanceof to){const e=n.constraints.reduce((i,s)=>i||(s instanceof t?s:null),null);if(e)return e}return null}class eo{constructor(t){this.values=Vt.fromObject({options:t})}constrain(t){const e=this.values.get("options");return e.length===0||e.filter(s=>s.value===t).length>0?t:e[0].value}}function no(n){var t;const e=Bc;if(Array.isArray(n))return(t=be({items:n},i=>({items:i.required.array(i.required.object({text:i.required.string,value:i.required.raw}))})))===null||t===void 0?void 0:t.items;if(typeof n=="object")return e.required.raw(n).value}function zh(n){if(Array.isArray(n))return n;const t=[];return Object.keys(n).forEach(e=>{t.push({text:e,value:n[e]})}),t}function Vh(n){return ue(n)?null:new eo(zh(n))}const Pl=jt("lst");class JR{constructor(t,e){this.onValueChange_=this.onValueChange_.bind(this),this.props_=e.props,this.element=t.createElement("div"),this.element.classList.add(Pl()),e.viewProps.bindClassModifiers(this.element);const i=t.createElement("select");i.classList.add(Pl("s")),e.viewProps.bindDisabled(i),this.element.appendChild(i),this.selectElement=i;const s=t.createElement("div");s.classList.add(Pl("m")),s.appendChild(Fa(t,"dropdown")),this.element.appendChild(s),e.value.emitter.on("change",this.onValueChange_),this.value_=e.value,jn(this.props_,"options",r=>{vg(this.selectElement),r.forEach(o=>{const a=t.createElement("option");a.textContent=o.text,this.selectElement.appendChild(a)}),this.update_()})}update_(){const t=this.props_.get("options").map(e=>e.value);this.selectElement.selectedIndex=t.indexOf(this.value_.rawValue)}onValueChange_(){this.update_()}}class Hi{constructor(t,e){this.onSelectChange_=this.onSelectChange_.bind(this),this.props=e.props,this.value=e.value,this.viewProps=e.viewProps,this.view=new JR(t,{props:this.props,value:this.value,viewProps:this.viewProps}),this.view.selectElement.addEventListener("change",this.onSelectChange_)}onSelectChange_(t){const e=t.currentTarget;this.value.rawValue=this.props.get("options")[e.selectedIndex].value}importProps(t){return pn(t,null,e=>({options:e.required.custom(no)}),e=>(this.props.set("options",zh(e.options)),!0))}exportProps(){return fn(null,{options:this.props.get("options")})}}const yp=jt("pop");class t2{constructor(t,e){this.element=t.createElement("div"),this.element.classList.add(yp()),e.viewProps.bindClassModifiers(this.element),di(e.shows,tr(this.element,yp(void 0,"v")))}}class Ag{constructor(t,e){this.shows=ge(!1),this.viewProps=e.viewProps,this.view=new t2(t,{shows:this.shows,viewProps:this.viewProps})}}const Sp=jt("txt");class e2{constructor(t,e){this.onChange_=this.onChange_.bind(this),this.element=t.createElement("div"),this.element.classList.add(Sp()),e.viewProps.bindClassModifiers(this.element),this.props_=e.props,this.props_.emitter.on("change",this.onChange_);const i=t.createElement("input");i.classList.add(Sp("i")),i.type="text",e.viewProps.bindDisabled(i),this.element.appendChild(i),this.inputElement=i,e.value.emitter.on("change",this.onChange_),this.value_=e.value,this.refresh()}refresh(){const t=this.props_.get("formatter");this.inputElement.value=t(this.value_.rawValue)}onChange_(){this.refresh()}}class Hr{constructor(t,e){this.onInputChange_=this.onInputChange_.bind(this),this.parser_=e.parser,this.props=e.props,this.value=e.value,this.viewProps=e.viewProps,this.view=new e2(t,{props:e.props,value:this.value,viewProps:this.viewProps}),this.view.inputElement.addEventListener("change",this.onInputChange_)}onInputChange_(t){const i=t.currentTarget.value,s=this.parser_(i);ue(s)||(this.value.rawValue=s),this.view.refresh()}}function n2(n){return String(n)}function Cg(n){return n==="false"?!1:!!n}function Ep(n){return n2(n)}function i2(n){return t=>n.reduce((e,i)=>e!==null?e:i(t),null)}const s2=ln(0);function Ma(n){return s2(n)+"%"}function Rg(n){return String(n)}function Gc(n){return n}function ir({primary:n,secondary:t,forward:e,backward:i}){let s=!1;function r(o){s||(s=!0,o(),s=!1)}n.emitter.on("change",o=>{r(()=>{t.setRawValue(e(n.rawValue,t.rawValue),o.options)})}),t.emitter.on("change",o=>{r(()=>{n.setRawValue(i(n.rawValue,t.rawValue),o.options)}),r(()=>{t.setRawValue(e(n.rawValue,t.rawValue),o.options)})}),r(()=>{t.setRawValue(e(n.rawValue,t.rawValue),{forceEmit:!1,last:!0})})}function on(n,t){const e=n*(t.altKey?.1:1)*(t.shiftKey?10:1);return t.upKey?+e:t.downKey?-e:0}function Gr(n){return{altKey:n.altKey,downKey:n.key==="ArrowDown",shiftKey:n.shiftKey,upKey:n.key==="ArrowUp"}}function vi(n){return{altKey:n.altKey,downKey:n.key==="ArrowLeft",shiftKey:n.shiftKey,upKey:n.key==="ArrowRight"}}function r2(n){return n==="ArrowUp"||n==="ArrowDown"}function Pg(n){return r2(n)||n==="ArrowLeft"||n==="ArrowRight"}function Ll(n,t){var e,i;const s=t.ownerDocument.defaultView,r=t.getBoundingClientRect();return{x:n.pageX-(((e=s&&s.scrollX)!==null&&e!==void 0?e:0)+r.left),y:n.pageY-(((i=s&&s.scrollY)!==null&&i!==void 0?i:0)+r.top)}}class us{constructor(t){this.lastTouch_=null,this.onDocumentMouseMove_=this.onDocumentMouseMove_.bind(this),this.onDocumentMouseUp_=this.onDocumentMouseUp_.bind(this),this.onMouseDown_=this.onMouseDown_.bind(this),this.onTouchEnd_=this.onTouchEnd_.bind(this),this.onTouchMove_=this.onTouchMove_.bind(this),this.onTouchStart_=this.onTouchStart_.bind(this),this.elem_=t,this.emitter=new Re,t.addEventListener("touchstart",this.onTouchStart_,{passive:!1}),t.addEventListener("touchmove",this.onTouchMove_,{passive:!0}),t.addEventListener("touchend",this.onTouchEnd_),t.addEventListener("mousedown",this.onMouseDown_)}computePosition_(t){const e=this.elem_.getBoundingClientRect();return{bounds:{width:e.width,height:e.height},point:t?{x:t.x,y:t.y}:null}}onMouseDown_(t){var e;t.preventDefault(),(e=t.currentTarget)===null||e===void 0||e.focus();const i=this.elem_.ownerDocument;i.addEventListener("mousemove",this.onDocumentMouseMove_),i.addEventListener("mouseup",this.onDocumentMouseUp_),this.emitter.emit("down",{altKey:t.altKey,data:this.computePosition_(Ll(t,this.elem_)),sender:this,shiftKey:t.shiftKey})}onDocumentMouseMove_(t){this.emitter.emit("move",{altKey:t.altKey,data:this.computePosition_(Ll(t,this.elem_)),sender:this,shiftKey:t.shiftKey})}onDocumentMouseUp_(t){const e=this.elem_.ownerDocument;e.removeEventListener("mousemove",this.onDocumentMouseMove_),e.removeEventListener("mouseup",this.onDocumentMouseUp_),this.emitter.emit("up",{altKey:t.altKey,data:this.computePosition_(Ll(t,this.elem_)),sender:this,shiftKey:t.shiftKey})}onTouchStart_(t){t.preventDefault();const e=t.targetTouches.item(0),i=this.elem_.getBoundingClientRect();this.emitter.emit("down",{altKey:t.altKey,data:this.computePosition_(e?{x:e.clientX-i.left,y:e.clientY-i.top}:void 0),sender:this,shiftKey:t.shiftKey}),this.lastTouch_=e}onTouchMove_(t){const e=t.targetTouches.item(0),i=this.elem_.getBoundingClientRect();this.emitter.emit("move",{altKey:t.altKey,data:this.computePosition_(e?{x:e.clientX-i.left,y:e.clientY-i.top}:void 0),sender:this,shiftKey:t.shiftKey}),this.lastTouch_=e}onTouchEnd_(t){var e;const i=(e=t.targetTouches.item(0))!==null&&e!==void 0?e:this.lastTouch_,s=this.elem_.getBoundingClientRect();this.emitter.emit("up",{altKey:t.altKey,data:this.computePosition_(i?{x:i.clientX-s.left,y:i.clientY-s.top}:void 0),sender:this,shiftKey:t.shiftKey})}}const bn=jt("txt");class o2{constructor(t,e){this.onChange_=this.onChange_.bind(this),this.props_=e.props,this.props_.emitter.on("change",this.onChange_),this.element=t.createElement("div"),this.element.classList.add(bn(),bn(void 0,"num")),e.arrayPosition&&this.element.classList.add(bn(void 0,e.arrayPosition)),e.viewProps.bindClassModifiers(this.element);const i=t.createElement("input");i.classList.add(bn("i")),i.type="text",e.viewProps.bindDisabled(i),this.element.appendChild(i),this.inputElement=i,this.onDraggingChange_=this.onDraggingChange_.bind(this),this.dragging_=e.dragging,this.dragging_.emitter.on("change",this.onDraggingChange_),this.element.classList.add(bn()),this.inputElement.classList.add(bn("i"));const s=t.createElement("div");s.classList.add(bn("k")),this.element.appendChild(s),this.knobElement=s;const r=t.createElementNS(qn,"svg");r.classList.add(bn("g")),this.knobElement.appendChild(r);const o=t.createElementNS(qn,"path");o.classList.add(bn("gb")),r.appendChild(o),this.guideBodyElem_=o;const a=t.createElementNS(qn,"path");a.classList.add(bn("gh")),r.appendChild(a),this.guideHeadElem_=a;const l=t.createElement("div");l.classList.add(jt("tt")()),this.knobElement.appendChild(l),this.tooltipElem_=l,e.value.emitter.on("change",this.onChange_),this.value=e.value,this.refresh()}onDraggingChange_(t){if(t.rawValue===null){this.element.classList.remove(bn(void 0,"drg"));return}this.element.classList.add(bn(void 0,"drg"));const e=t.rawValue/this.props_.get("pointerScale"),i=e+(e>0?-1:e<0?1:0),s=Ie(-i,-4,4);this.guideHeadElem_.setAttributeNS(null,"d",[`M ${i+s},0 L${i},4 L${i+s},8`,`M ${e},-1 L${e},9`].join(" ")),this.guideBodyElem_.setAttributeNS(null,"d",`M 0,4 L${e},4`);const r=this.props_.get("formatter");this.tooltipElem_.textContent=r(this.value.rawValue),this.tooltipElem_.style.left=`${e}px`}refresh(){const t=this.props_.get("formatter");this.inputElement.value=t(this.value.rawValue)}onChange_(){this.refresh()}}class io{constructor(t,e){var i;this.originRawValue_=0,this.onInputChange_=this.onInputChange_.bind(this),this.onInputKeyDown_=this.onInputKeyDown_.bind(this),this.onInputKeyUp_=this.onInputKeyUp_.bind(this),this.onPointerDown_=this.onPointerDown_.bind(this),this.onPointerMove_=this.onPointerMove_.bind(this),this.onPointerUp_=this.onPointerUp_.bind(this),this.parser_=e.parser,this.props=e.props,this.sliderProps_=(i=e.sliderProps)!==null&&i!==void 0?i:null,this.value=e.value,this.viewProps=e.viewProps,this.dragging_=ge(null),this.view=new o2(t,{arrayPosition:e.arrayPosition,dragging:this.dragging_,props:this.props,value:this.value,viewProps:this.viewProps}),this.view.inputElement.addEventListener("change",this.onInputChange_),this.view.inputElement.addEventListener("keydown",this.onInputKeyDown_),this.view.inputElement.addEventListener("keyup",this.onInputKeyUp_);const s=new us(this.view.knobElement);s.emitter.on("down",this.onPointerDown_),s.emitter.on("move",this.onPointerMove_),s.emitter.on("up",this.onPointerUp_)}constrainValue_(t){var e,i;const s=(e=this.sliderProps_)===null||e===void 0?void 0:e.get("min"),r=(i=this.sliderProps_)===null||i===void 0?void 0:i.get("max");let o=t;return s!==void 0&&(o=Math.max(o,s)),r!==void 0&&(o=Math.min(o,r)),o}onInputChange_(t){const i=t.currentTarget.value,s=this.parser_(i);ue(s)||(this.value.rawValue=this.constrainValue_(s)),this.view.refresh()}onInputKeyDown_(t){const e=on(this.props.get("keyScale"),Gr(t));e!==0&&this.value.setRawValue(this.constrainValue_(this.value.rawValue+e),{forceEmit:!1,last:!1})}onInputKeyUp_(t){on(this.props.get("keyScale"),Gr(t))!==0&&this.value.setRawValue(this.value.rawValue,{forceEmit:!0,last:!0})}onPointerDown_(){this.originRawValue_=this.value.rawValue,this.dragging_.rawValue=0}computeDraggingValue_(t){if(!t.point)return null;const e=t.point.x-t.bounds.width/2;return this.constrainValue_(this.originRawValue_+e*this.props.get("pointerScale"))}onPointerMove_(t){const e=this.computeDraggingValue_(t.data);e!==null&&(this.value.setRawValue(e,{forceEmit:!1,last:!1}),this.dragging_.rawValue=this.value.rawValue-this.originRawValue_)}onPointerUp_(t){const e=this.computeDraggingValue_(t.data);e!==null&&(this.value.setRawValue(e,{forceEmit:!0,last:!0}),this.dragging_.rawValue=null)}}const Dl=jt("sld");class a2{constructor(t,e){this.onChange_=this.onChange_.bind(this),this.props_=e.props,this.props_.emitter.on("change",this.onChange_),this.element=t.createElement("div"),this.element.classList.add(Dl()),e.viewProps.bindClassModifiers(this.element);const i=t.createElement("div");i.classList.add(Dl("t")),e.viewProps.bindTabIndex(i),this.element.appendChild(i),this.trackElement=i;const s=t.createElement("div");s.classList.add(Dl("k")),this.trackElement.appendChild(s),this.knobElement=s,e.value.emitter.on("change",this.onChange_),this.value=e.value,this.update_()}update_(){const t=Ie(ne(this.value.rawValue,this.props_.get("min"),this.props_.get("max"),0,100),0,100);this.knobElement.style.width=`${t}%`}onChange_(){this.update_()}}class l2{constructor(t,e){this.onKeyDown_=this.onKeyDown_.bind(this),this.onKeyUp_=this.onKeyUp_.bind(this),this.onPointerDownOrMove_=this.onPointerDownOrMove_.bind(this),this.onPointerUp_=this.onPointerUp_.bind(this),this.value=e.value,this.viewProps=e.viewProps,this.props=e.props,this.view=new a2(t,{props:this.props,value:this.value,viewProps:this.viewProps}),this.ptHandler_=new us(this.view.trackElement),this.ptHandler_.emitter.on("down",this.onPointerDownOrMove_),this.ptHandler_.emitter.on("move",this.onPointerDownOrMove_),this.ptHandler_.emitter.on("up",this.onPointerUp_),this.view.trackElement.addEventListener("keydown",this.onKeyDown_),this.view.trackElement.addEventListener("keyup",this.onKeyUp_)}handlePointerEvent_(t,e){t.point&&this.value.setRawValue(ne(Ie(t.point.x,0,t.bounds.width),0,t.bounds.width,this.props.get("min"),this.props.get("max")),e)}onPointerDownOrMove_(t){this.handlePointerEvent_(t.data,{forceEmit:!1,last:!1})}onPointerUp_(t){this.handlePointerEvent_(t.data,{forceEmit:!0,last:!0})}onKeyDown_(t){const e=on(this.props.get("keyScale"),vi(t));e!==0&&this.value.setRawValue(this.value.rawValue+e,{forceEmit:!1,last:!1})}onKeyUp_(t){on(this.props.get("keyScale"),vi(t))!==0&&this.value.setRawValue(this.value.rawValue,{forceEmit:!0,last:!0})}}const Il=jt("sldtxt");class c2{constructor(t,e){this.element=t.createElement("div"),this.element.classList.add(Il());const i=t.createElement("div");i.classList.add(Il("s")),this.sliderView_=e.sliderView,i.appendChild(this.sliderView_.element),this.element.appendChild(i);const s=t.createElement("div");s.classList.add(Il("t")),this.textView_=e.textView,s.appendChild(this.textView_.element),this.element.appendChild(s)}}class Ta{constructor(t,e){this.value=e.value,this.viewProps=e.viewProps,this.sliderC_=new l2(t,{props:e.sliderProps,value:e.value,viewProps:this.viewProps}),this.textC_=new io(t,{parser:e.parser,props:e.textProps,sliderProps:e.sliderProps,value:e.value,viewProps:e.viewProps}),this.view=new c2(t,{sliderView:this.sliderC_.view,textView:this.textC_.view})}get sliderController(){return this.sliderC_}get textController(){return this.textC_}importProps(t){return pn(t,null,e=>({max:e.required.number,min:e.required.number}),e=>{const i=this.sliderC_.props;return i.set("max",e.max),i.set("min",e.min),!0})}exportProps(){const t=this.sliderC_.props;return fn(null,{max:t.get("max"),min:t.get("min")})}}function Lg(n){return{sliderProps:new Vt({keyScale:n.keyScale,max:n.max,min:n.min}),textProps:new Vt({formatter:ge(n.formatter),keyScale:n.keyScale,pointerScale:ge(n.pointerScale)})}}const h2={containerUnitSize:"cnt-usz"};function Dg(n){return`--${h2[n]}`}function Wr(n){return fg(n)}function Fi(n){if(kc(n))return be(n,Wr)}function li(n,t){if(!n)return;const e=[],i=ug(n,t);i&&e.push(i);const s=dg(n);return s&&e.push(s),new to(e)}function u2(n){return n?n.major===er.major:!1}function Ig(n){if(n==="inline"||n==="popup")return n}function so(n,t){n.write(t)}const Xo=jt("ckb");class d2{constructor(t,e){this.onValueChange_=this.onValueChange_.bind(this),this.element=t.createElement("div"),this.element.classList.add(Xo()),e.viewProps.bindClassModifiers(this.element);const i=t.createElement("label");i.classList.add(Xo("l")),this.element.appendChild(i),this.labelElement=i;const s=t.createElement("input");s.classList.add(Xo("i")),s.type="checkbox",this.labelElement.appendChild(s),this.inputElement=s,e.viewProps.bindDisabled(this.inputElement);const r=t.createElement("div");r.classList.add(Xo("w")),this.labelElement.appendChild(r);const o=Fa(t,"check");r.appendChild(o),e.value.emitter.on("change",this.onValueChange_),this.value=e.value,this.update_()}update_(){this.inputElement.checked=this.value.rawValue}onValueChange_(){this.update_()}}class p2{constructor(t,e){this.onInputChange_=this.onInputChange_.bind(this),this.onLabelMouseDown_=this.onLabelMouseDown_.bind(this),this.value=e.value,this.viewProps=e.viewProps,this.view=new d2(t,{value:this.value,viewProps:this.viewProps}),this.view.inputElement.addEventListener("change",this.onInputChange_),this.view.labelElement.addEventListener("mousedown",this.onLabelMouseDown_)}onInputChange_(t){const e=t.currentTarget;this.value.rawValue=e.checked,t.preventDefault(),t.stopPropagation()}onLabelMouseDown_(t){t.preventDefault()}}function f2(n){const t=[],e=Vh(n.options);return e&&t.push(e),new to(t)}const m2=nn({id:"input-bool",type:"input",accept:(n,t)=>{if(typeof n!="boolean")return null;const e=be(t,i=>({options:i.optional.custom(no),readonly:i.optional.constant(!1)}));return e?{initialValue:n,params:e}:null},binding:{reader:n=>Cg,constraint:n=>f2(n.params),writer:n=>so},controller:n=>{const t=n.document,e=n.value,i=n.constraint,s=i&&Ea(i,eo);return s?new Hi(t,{props:new Vt({options:s.values.value("options")}),value:e,viewProps:n.viewProps}):new p2(t,{value:e,viewProps:n.viewProps})},api(n){return typeof n.controller.value.rawValue!="boolean"?null:n.controller.valueController instanceof Hi?new Bh(n.controller):null}}),Qi=jt("col");class g2{constructor(t,e){this.element=t.createElement("div"),this.element.classList.add(Qi()),e.foldable.bindExpandedClass(this.element,Qi(void 0,"expanded")),jn(e.foldable,"completed",tr(this.element,Qi(void 0,"cpl")));const i=t.createElement("div");i.classList.add(Qi("h")),this.element.appendChild(i);const s=t.createElement("div");s.classList.add(Qi("s")),i.appendChild(s),this.swatchElement=s;const r=t.createElement("div");if(r.classList.add(Qi("t")),i.appendChild(r),this.textElement=r,e.pickerLayout==="inline"){const o=t.createElement("div");o.classList.add(Qi("p")),this.element.appendChild(o),this.pickerElement=o}else this.pickerElement=null}}function v2(n,t,e){const i=Ie(n/255,0,1),s=Ie(t/255,0,1),r=Ie(e/255,0,1),o=Math.max(i,s,r),a=Math.min(i,s,r),l=o-a;let c=0,h=0;const d=(a+o)/2;return l!==0&&(h=l/(1-Math.abs(o+a-1)),i===o?c=(s-r)/l:s===o?c=2+(r-i)/l:c=4+(i-s)/l,c=c/6+(c<0?1:0)),[c*360,h*100,d*100]}function _2(n,t,e){const i=(n%360+360)%360,s=Ie(t/100,0,1),r=Ie(e/100,0,1),o=(1-Math.abs(2*r-1))*s,a=o*(1-Math.abs(i/60%2-1)),l=r-o/2;let c,h,d;return i>=0&&i<60?[c,h,d]=[o,a,0]:i>=60&&i<120?[c,h,d]=[a,o,0]:i>=120&&i<180?[c,h,d]=[0,o,a]:i>=180&&i<240?[c,h,d]=[0,a,o]:i>=240&&i<300?[c,h,d]=[a,0,o]:[c,h,d]=[o,0,a],[(c+l)*255,(h+l)*255,(d+l)*255]}function x2(n,t,e){const i=Ie(n/255,0,1),s=Ie(t/255,0,1),r=Ie(e/255,0,1),o=Math.max(i,s,r),a=Math.min(i,s,r),l=o-a;let c;l===0?c=0:o===i?c=60*(((s-r)/l%6+6)%6):o===s?c=60*((r-i)/l+2):c=60*((i-s)/l+4);const h=o===0?0:l/o,d=o;return[c,h*100,d*100]}function Ng(n,t,e){const i=lg(n,360),s=Ie(t/100,0,1),r=Ie(e/100,0,1),o=r*s,a=o*(1-Math.abs(i/60%2-1)),l=r-o;let c,h,d;return i>=0&&i<60?[c,h,d]=[o,a,0]:i>=60&&i<120?[c,h,d]=[a,o,0]:i>=120&&i<180?[c,h,d]=[0,o,a]:i>=180&&i<240?[c,h,d]=[0,a,o]:i>=240&&i<300?[c,h,d]=[a,0,o]:[c,h,d]=[o,0,a],[(c+l)*255,(h+l)*255,(d+l)*255]}function b2(n,t,e){const i=e+t*(100-Math.abs(2*e-100))/200;return[n,i!==0?t*(100-Math.abs(2*e-100))/i:0,e+t*(100-Math.abs(2*e-100))/200]}function w2(n,t,e){const i=100-Math.abs(e*(200-t)/100-100);return[n,i!==0?t*e/i:0,e*(200-t)/200]}function Qn(n){return[n[0],n[1],n[2]]}function Ba(n,t){return[n[0],n[1],n[2],t]}const y2={hsl:{hsl:(n,t,e)=>[n,t,e],hsv:b2,rgb:_2},hsv:{hsl:w2,hsv:(n,t,e)=>[n,t,e],rgb:Ng},rgb:{hsl:v2,hsv:x2,rgb:(n,t,e)=>[n,t,e]}};function Ys(n,t){return[t==="float"?1:n==="rgb"?255:360,t==="float"?1:n==="rgb"?255:100,t==="float"?1:n==="rgb"?255:100]}function S2(n,t){return n===t?t:lg(n,t)}function Ug(n,t,e){var i;const s=Ys(t,e);return[t==="rgb"?Ie(n[0],0,s[0]):S2(n[0],s[0]),Ie(n[1],0,s[1]),Ie(n[2],0,s[2]),Ie((i=n[3])!==null&&i!==void 0?i:1,0,1)]}function Mp(n,t,e,i){const s=Ys(t,e),r=Ys(t,i);return n.map((o,a)=>o/s[a]*r[a])}function Og(n,t,e){const i=Mp(n,t.mode,t.type,"int"),s=y2[t.mode][e.mode](...i);return Mp(s,e.mode,"int",e.type)}class Jt{static black(){return new Jt([0,0,0],"rgb")}constructor(t,e){this.type="int",this.mode=e,this.comps_=Ug(t,e,this.type)}getComponents(t){return Ba(Og(Qn(this.comps_),{mode:this.mode,type:this.type},{mode:t??this.mode,type:this.type}),this.comps_[3])}toRgbaObject(){const t=this.getComponents("rgb");return{r:t[0],g:t[1],b:t[2],a:t[3]}}}const Ri=jt("colp");class E2{constructor(t,e){this.alphaViews_=null,this.element=t.createElement("div"),this.element.classList.add(Ri()),e.viewProps.bindClassModifiers(this.element);const i=t.createElement("div");i.classList.add(Ri("hsv"));const s=t.createElement("div");s.classList.add(Ri("sv")),this.svPaletteView_=e.svPaletteView,s.appendChild(this.svPaletteView_.element),i.appendChild(s);const r=t.createElement("div");r.classList.add(Ri("h")),this.hPaletteView_=e.hPaletteView,r.appendChild(this.hPaletteView_.element),i.appendChild(r),this.element.appendChild(i);const o=t.createElement("div");if(o.classList.add(Ri("rgb")),this.textsView_=e.textsView,o.appendChild(this.textsView_.element),this.element.appendChild(o),e.alphaViews){this.alphaViews_={palette:e.alphaViews.palette,text:e.alphaViews.text};const a=t.createElement("div");a.classList.add(Ri("a"));const l=t.createElement("div");l.classList.add(Ri("ap")),l.appendChild(this.alphaViews_.palette.element),a.appendChild(l);const c=t.createElement("div");c.classList.add(Ri("at")),c.appendChild(this.alphaViews_.text.element),a.appendChild(c),this.element.appendChild(a)}}get allFocusableElements(){const t=[this.svPaletteView_.element,this.hPaletteView_.element,this.textsView_.modeSelectElement,...this.textsView_.inputViews.map(e=>e.inputElement)];return this.alphaViews_&&t.push(this.alphaViews_.palette.element,this.alphaViews_.text.inputElement),t}}function M2(n){return n==="int"?"int":n==="float"?"float":void 0}function Hh(n){return be(n,t=>({color:t.optional.object({alpha:t.optional.boolean,type:t.optional.custom(M2)}),expanded:t.optional.boolean,picker:t.optional.custom(Ig),readonly:t.optional.constant(!1)}))}function ls(n){return n?.1:1}function Fg(n){var t;return(t=n.color)===null||t===void 0?void 0:t.type}class Gh{constructor(t,e){this.type="float",this.mode=e,this.comps_=Ug(t,e,this.type)}getComponents(t){return Ba(Og(Qn(this.comps_),{mode:this.mode,type:this.type},{mode:t??this.mode,type:this.type}),this.comps_[3])}toRgbaObject(){const t=this.getComponents("rgb");return{r:t[0],g:t[1],b:t[2],a:t[3]}}}const T2={int:(n,t)=>new Jt(n,t),float:(n,t)=>new Gh(n,t)};function Wh(n,t,e){return T2[e](n,t)}function A2(n){return n.type==="float"}function C2(n){return n.type==="int"}function R2(n){const t=n.getComponents(),e=Ys(n.mode,"int");return new Jt([Math.round(ne(t[0],0,1,0,e[0])),Math.round(ne(t[1],0,1,0,e[1])),Math.round(ne(t[2],0,1,0,e[2])),t[3]],n.mode)}function P2(n){const t=n.getComponents(),e=Ys(n.mode,"int");return new Gh([ne(t[0],0,e[0],0,1),ne(t[1],0,e[1],0,1),ne(t[2],0,e[2],0,1),t[3]],n.mode)}function en(n,t){if(n.type===t)return n;if(C2(n)&&t==="float")return P2(n);if(A2(n)&&t==="int")return R2(n);throw ye.shouldNeverHappen()}function L2(n,t){return n.alpha===t.alpha&&n.mode===t.mode&&n.notation===t.notation&&n.type===t.type}function Sn(n,t){const e=n.match(/^(.+)%$/);return Math.min(e?parseFloat(e[1])*.01*t:parseFloat(n),t)}const D2={deg:n=>n,grad:n=>n*360/400,rad:n=>n*360/(2*Math.PI),turn:n=>n*360};function kg(n){const t=n.match(/^([0-9.]+?)(deg|grad|rad|turn)$/);if(!t)return parseFloat(n);const e=parseFloat(t[1]),i=t[2];return D2[i](e)}function Bg(n){const t=n.match(/^rgb\(\s*([0-9A-Fa-f.]+%?)\s*,\s*([0-9A-Fa-f.]+%?)\s*,\s*([0-9A-Fa-f.]+%?)\s*\)$/);if(!t)return null;const e=[Sn(t[1],255),Sn(t[2],255),Sn(t[3],255)];return isNaN(e[0])||isNaN(e[1])||isNaN(e[2])?null:e}function I2(n){const t=Bg(n);return t?new Jt(t,"rgb"):null}function zg(n){const t=n.match(/^rgba\(\s*([0-9A-Fa-f.]+%?)\s*,\s*([0-9A-Fa-f.]+%?)\s*,\s*([0-9A-Fa-f.]+%?)\s*,\s*([0-9A-Fa-f.]+%?)\s*\)$/);if(!t)return null;const e=[Sn(t[1],255),Sn(t[2],255),Sn(t[3],255),Sn(t[4],1)];return isNaN(e[0])||isNaN(e[1])||isNaN(e[2])||isNaN(e[3])?null:e}function N2(n){const t=zg(n);return t?new Jt(t,"rgb"):null}function Vg(n){const t=n.match(/^hsl\(\s*([0-9A-Fa-f.]+(?:deg|grad|rad|turn)?)\s*,\s*([0-9A-Fa-f.]+%?)\s*,\s*([0-9A-Fa-f.]+%?)\s*\)$/);if(!t)return null;const e=[kg(t[1]),Sn(t[2],100),Sn(t[3],100)];return isNaN(e[0])||isNaN(e[1])||isNaN(e[2])?null:e}function U2(n){const t=Vg(n);return t?new Jt(t,"hsl"):null}function Hg(n){const t=n.match(/^hsla\(\s*([0-9A-Fa-f.]+(?:deg|grad|rad|turn)?)\s*,\s*([0-9A-Fa-f.]+%?)\s*,\s*([0-9A-Fa-f.]+%?)\s*,\s*([0-9A-Fa-f.]+%?)\s*\)$/);if(!t)return null;const e=[kg(t[1]),Sn(t[2],100),Sn(t[3],100),Sn(t[4],1)];return isNaN(e[0])||isNaN(e[1])||isNaN(e[2])||isNaN(e[3])?null:e}function O2(n){const t=Hg(n);return t?new Jt(t,"hsl"):null}function Gg(n){const t=n.match(/^#([0-9A-Fa-f])([0-9A-Fa-f])([0-9A-Fa-f])$/);if(t)return[parseInt(t[1]+t[1],16),parseInt(t[2]+t[2],16),parseInt(t[3]+t[3],16)];const e=n.match(/^(?:#|0x)([0-9A-Fa-f]{2})([0-9A-Fa-f]{2})([0-9A-Fa-f]{2})$/);return e?[parseInt(e[1],16),parseInt(e[2],16),parseInt(e[3],16)]:null}function F2(n){const t=Gg(n);return t?new Jt(t,"rgb"):null}function Wg(n){const t=n.match(/^#([0-9A-Fa-f])([0-9A-Fa-f])([0-9A-Fa-f])([0-9A-Fa-f])$/);if(t)return[parseInt(t[1]+t[1],16),parseInt(t[2]+t[2],16),parseInt(t[3]+t[3],16),ne(parseInt(t[4]+t[4],16),0,255,0,1)];const e=n.match(/^(?:#|0x)?([0-9A-Fa-f]{2})([0-9A-Fa-f]{2})([0-9A-Fa-f]{2})([0-9A-Fa-f]{2})$/);return e?[parseInt(e[1],16),parseInt(e[2],16),parseInt(e[3],16),ne(parseInt(e[4],16),0,255,0,1)]:null}function k2(n){const t=Wg(n);return t?new Jt(t,"rgb"):null}function Xg(n){const t=n.match(/^\{\s*r\s*:\s*([0-9A-Fa-f.]+%?)\s*,\s*g\s*:\s*([0-9A-Fa-f.]+%?)\s*,\s*b\s*:\s*([0-9A-Fa-f.]+%?)\s*\}$/);if(!t)return null;const e=[parseFloat(t[1]),parseFloat(t[2]),parseFloat(t[3])];return isNaN(e[0])||isNaN(e[1])||isNaN(e[2])?null:e}function B2(n){return t=>{const e=Xg(t);return e?Wh(e,"rgb",n):null}}function qg(n){const t=n.match(/^\{\s*r\s*:\s*([0-9A-Fa-f.]+%?)\s*,\s*g\s*:\s*([0-9A-Fa-f.]+%?)\s*,\s*b\s*:\s*([0-9A-Fa-f.]+%?)\s*,\s*a\s*:\s*([0-9A-Fa-f.]+%?)\s*\}$/);if(!t)return null;const e=[parseFloat(t[1]),parseFloat(t[2]),parseFloat(t[3]),parseFloat(t[4])];return isNaN(e[0])||isNaN(e[1])||isNaN(e[2])||isNaN(e[3])?null:e}function z2(n){return t=>{const e=qg(t);return e?Wh(e,"rgb",n):null}}const V2=[{parser:Gg,result:{alpha:!1,mode:"rgb",notation:"hex"}},{parser:Wg,result:{alpha:!0,mode:"rgb",notation:"hex"}},{parser:Bg,result:{alpha:!1,mode:"rgb",notation:"func"}},{parser:zg,result:{alpha:!0,mode:"rgb",notation:"func"}},{parser:Vg,result:{alpha:!1,mode:"hsl",notation:"func"}},{parser:Hg,result:{alpha:!0,mode:"hsl",notation:"func"}},{parser:Xg,result:{alpha:!1,mode:"rgb",notation:"object"}},{parser:qg,result:{alpha:!0,mode:"rgb",notation:"object"}}];function H2(n){return V2.reduce((t,{parser:e,result:i})=>t||(e(n)?i:null),null)}function G2(n,t="int"){const e=H2(n);return e?e.notation==="hex"&&t!=="float"?Object.assign(Object.assign({},e),{type:"int"}):e.notation==="func"?Object.assign(Object.assign({},e),{type:t}):null:null}function ro(n){const t=[F2,k2,I2,N2,U2,O2];t.push(B2("int"),z2("int"));const e=i2(t);return i=>{const s=e(i);return s?en(s,n):null}}function W2(n){const t=ro("int");if(typeof n!="string")return Jt.black();const e=t(n);return e??Jt.black()}function $g(n){const t=Ie(Math.floor(n),0,255).toString(16);return t.length===1?`0${t}`:t}function Xh(n,t="#"){const e=Qn(n.getComponents("rgb")).map($g).join("");return`${t}${e}`}function qh(n,t="#"){const e=n.getComponents("rgb"),i=[e[0],e[1],e[2],e[3]*255].map($g).join("");return`${t}${i}`}function Yg(n){const t=ln(0),e=en(n,"int");return`rgb(${Qn(e.getComponents("rgb")).map(s=>t(s)).join(", ")})`}function sa(n){const t=ln(2),e=ln(0);return`rgba(${en(n,"int").getComponents("rgb").map((r,o)=>(o===3?t:e)(r)).join(", ")})`}function X2(n){const t=[ln(0),Ma,Ma],e=en(n,"int");return`hsl(${Qn(e.getComponents("hsl")).map((s,r)=>t[r](s)).join(", ")})`}function q2(n){const t=[ln(0),Ma,Ma,ln(2)];return`hsla(${en(n,"int").getComponents("hsl").map((s,r)=>t[r](s)).join(", ")})`}function Kg(n,t){const e=ln(t==="float"?2:0),i=["r","g","b"],s=en(n,t);return`{${Qn(s.getComponents("rgb")).map((o,a)=>`${i[a]}: ${e(o)}`).join(", ")}}`}function $2(n){return t=>Kg(t,n)}function Zg(n,t){const e=ln(2),i=ln(t==="float"?2:0),s=["r","g","b","a"];return`{${en(n,t).getComponents("rgb").map((a,l)=>{const c=l===3?e:i;return`${s[l]}: ${c(a)}`}).join(", ")}}`}function Y2(n){return t=>Zg(t,n)}const K2=[{format:{alpha:!1,mode:"rgb",notation:"hex",type:"int"},stringifier:Xh},{format:{alpha:!0,mode:"rgb",notation:"hex",type:"int"},stringifier:qh},{format:{alpha:!1,mode:"rgb",notation:"func",type:"int"},stringifier:Yg},{format:{alpha:!0,mode:"rgb",notation:"func",type:"int"},stringifier:sa},{format:{alpha:!1,mode:"hsl",notation:"func",type:"int"},stringifier:X2},{format:{alpha:!0,mode:"hsl",notation:"func",type:"int"},stringifier:q2},...["int","float"].reduce((n,t)=>[...n,{format:{alpha:!1,mode:"rgb",notation:"object",type:t},stringifier:$2(t)},{format:{alpha:!0,mode:"rgb",notation:"object",type:t},stringifier:Y2(t)}],[])];function jg(n){return K2.reduce((t,e)=>t||(L2(e.format,n)?e.stringifier:null),null)}const vr=jt("apl");class Z2{constructor(t,e){this.onValueChange_=this.onValueChange_.bind(this),this.value=e.value,this.value.emitter.on("change",this.onValueChange_),this.element=t.createElement("div"),this.element.classList.add(vr()),e.viewProps.bindClassModifiers(this.element),e.viewProps.bindTabIndex(this.element);const i=t.createElement("div");i.classList.add(vr("b")),this.element.appendChild(i);const s=t.createElement("div");s.classList.add(vr("c")),i.appendChild(s),this.colorElem_=s;const r=t.createElement("div");r.classList.add(vr("m")),this.element.appendChild(r),this.markerElem_=r;const o=t.createElement("div");o.classList.add(vr("p")),this.markerElem_.appendChild(o),this.previewElem_=o,this.update_()}update_(){const t=this.value.rawValue,e=t.getComponents("rgb"),i=new Jt([e[0],e[1],e[2],0],"rgb"),s=new Jt([e[0],e[1],e[2],255],"rgb"),r=["to right",sa(i),sa(s)];this.colorElem_.style.background=`linear-gradient(${r.join(",")})`,this.previewElem_.style.backgroundColor=sa(t);const o=ne(e[3],0,1,0,100);this.markerElem_.style.left=`${o}%`}onValueChange_(){this.update_()}}class j2{constructor(t,e){this.onKeyDown_=this.onKeyDown_.bind(this),this.onKeyUp_=this.onKeyUp_.bind(this),this.onPointerDown_=this.onPointerDown_.bind(this),this.onPointerMove_=this.onPointerMove_.bind(this),this.onPointerUp_=this.onPointerUp_.bind(this),this.value=e.value,this.viewProps=e.viewProps,this.view=new Z2(t,{value:this.value,viewProps:this.viewProps}),this.ptHandler_=new us(this.view.element),this.ptHandler_.emitter.on("down",this.onPointerDown_),this.ptHandler_.emitter.on("move",this.onPointerMove_),this.ptHandler_.emitter.on("up",this.onPointerUp_),this.view.element.addEventListener("keydown",this.onKeyDown_),this.view.element.addEventListener("keyup",this.onKeyUp_)}handlePointerEvent_(t,e){if(!t.point)return;const i=t.point.x/t.bounds.width,s=this.value.rawValue,[r,o,a]=s.getComponents("hsv");this.value.setRawValue(new Jt([r,o,a,i],"hsv"),e)}onPointerDown_(t){this.handlePointerEvent_(t.data,{forceEmit:!1,last:!1})}onPointerMove_(t){this.handlePointerEvent_(t.data,{forceEmit:!1,last:!1})}onPointerUp_(t){this.handlePointerEvent_(t.data,{forceEmit:!0,last:!0})}onKeyDown_(t){const e=on(ls(!0),vi(t));if(e===0)return;const i=this.value.rawValue,[s,r,o,a]=i.getComponents("hsv");this.value.setRawValue(new Jt([s,r,o,a+e],"hsv"),{forceEmit:!1,last:!1})}onKeyUp_(t){on(ls(!0),vi(t))!==0&&this.value.setRawValue(this.value.rawValue,{forceEmit:!0,last:!0})}}const Ms=jt("coltxt");function Q2(n){const t=n.createElement("select"),e=[{text:"RGB",value:"rgb"},{text:"HSL",value:"hsl"},{text:"HSV",value:"hsv"},{text:"HEX",value:"hex"}];return t.appendChild(e.reduce((i,s)=>{const r=n.createElement("option");return r.textContent=s.text,r.value=s.value,i.appendChild(r),i},n.createDocumentFragment())),t}class J2{constructor(t,e){this.element=t.createElement("div"),this.element.classList.add(Ms()),e.viewProps.bindClassModifiers(this.element);const i=t.createElement("div");i.classList.add(Ms("m")),this.modeElem_=Q2(t),this.modeElem_.classList.add(Ms("ms")),i.appendChild(this.modeSelectElement),e.viewProps.bindDisabled(this.modeElem_);const s=t.createElement("div");s.classList.add(Ms("mm")),s.appendChild(Fa(t,"dropdown")),i.appendChild(s),this.element.appendChild(i);const r=t.createElement("div");r.classList.add(Ms("w")),this.element.appendChild(r),this.inputsElem_=r,this.inputViews_=e.inputViews,this.applyInputViews_(),di(e.mode,o=>{this.modeElem_.value=o})}get modeSelectElement(){return this.modeElem_}get inputViews(){return this.inputViews_}set inputViews(t){this.inputViews_=t,this.applyInputViews_()}applyInputViews_(){vg(this.inputsElem_);const t=this.element.ownerDocument;this.inputViews_.forEach(e=>{const i=t.createElement("div");i.classList.add(Ms("c")),i.appendChild(e.element),this.inputsElem_.appendChild(i)})}}function tP(n){return ln(n==="float"?2:0)}function eP(n,t,e){const i=Ys(n,t)[e];return new jr({min:0,max:i})}function nP(n,t,e){return new io(n,{arrayPosition:e===0?"fst":e===2?"lst":"mid",parser:t.parser,props:Vt.fromObject({formatter:tP(t.colorType),keyScale:ls(!1),pointerScale:t.colorType==="float"?.01:1}),value:ge(0,{constraint:eP(t.colorMode,t.colorType,e)}),viewProps:t.viewProps})}function iP(n,t){const e={colorMode:t.colorMode,colorType:t.colorType,parser:gi,viewProps:t.viewProps};return[0,1,2].map(i=>{const s=nP(n,e,i);return ir({primary:t.value,secondary:s.value,forward(r){return en(r,t.colorType).getComponents(t.colorMode)[i]},backward(r,o){const a=t.colorMode,c=en(r,t.colorType).getComponents(a);c[i]=o;const h=Wh(Ba(Qn(c),c[3]),a,t.colorType);return en(h,"int")}}),s})}function sP(n,t){const e=new Hr(n,{parser:ro("int"),props:Vt.fromObject({formatter:Xh}),value:ge(Jt.black()),viewProps:t.viewProps});return ir({primary:t.value,secondary:e.value,forward:i=>new Jt(Qn(i.getComponents()),i.mode),backward:(i,s)=>new Jt(Ba(Qn(s.getComponents(i.mode)),i.getComponents()[3]),i.mode)}),[e]}function rP(n){return n!=="hex"}class oP{constructor(t,e){this.onModeSelectChange_=this.onModeSelectChange_.bind(this),this.colorType_=e.colorType,this.value=e.value,this.viewProps=e.viewProps,this.colorMode=ge(this.value.rawValue.mode),this.ccs_=this.createComponentControllers_(t),this.view=new J2(t,{mode:this.colorMode,inputViews:[this.ccs_[0].view,this.ccs_[1].view,this.ccs_[2].view],viewProps:this.viewProps}),this.view.modeSelectElement.addEventListener("change",this.onModeSelectChange_)}createComponentControllers_(t){const e=this.colorMode.rawValue;return rP(e)?iP(t,{colorMode:e,colorType:this.colorType_,value:this.value,viewProps:this.viewProps}):sP(t,{value:this.value,viewProps:this.viewProps})}onModeSelectChange_(t){const e=t.currentTarget;this.colorMode.rawValue=e.value,this.ccs_=this.createComponentControllers_(this.view.element.ownerDocument),this.view.inputViews=this.ccs_.map(i=>i.view)}}const Nl=jt("hpl");class aP{constructor(t,e){this.onValueChange_=this.onValueChange_.bind(this),this.value=e.value,this.value.emitter.on("change",this.onValueChange_),this.element=t.createElement("div"),this.element.classList.add(Nl()),e.viewProps.bindClassModifiers(this.element),e.viewProps.bindTabIndex(this.element);const i=t.createElement("div");i.classList.add(Nl("c")),this.element.appendChild(i);const s=t.createElement("div");s.classList.add(Nl("m")),this.element.appendChild(s),this.markerElem_=s,this.update_()}update_(){const t=this.value.rawValue,[e]=t.getComponents("hsv");this.markerElem_.style.backgroundColor=Yg(new Jt([e,100,100],"hsv"));const i=ne(e,0,360,0,100);this.markerElem_.style.left=`${i}%`}onValueChange_(){this.update_()}}class lP{constructor(t,e){this.onKeyDown_=this.onKeyDown_.bind(this),this.onKeyUp_=this.onKeyUp_.bind(this),this.onPointerDown_=this.onPointerDown_.bind(this),this.onPointerMove_=this.onPointerMove_.bind(this),this.onPointerUp_=this.onPointerUp_.bind(this),this.value=e.value,this.viewProps=e.viewProps,this.view=new aP(t,{value:this.value,viewProps:this.viewProps}),this.ptHandler_=new us(this.view.element),this.ptHandler_.emitter.on("down",this.onPointerDown_),this.ptHandler_.emitter.on("move",this.onPointerMove_),this.ptHandler_.emitter.on("up",this.onPointerUp_),this.view.element.addEventListener("keydown",this.onKeyDown_),this.view.element.addEventListener("keyup",this.onKeyUp_)}handlePointerEvent_(t,e){if(!t.point)return;const i=ne(Ie(t.point.x,0,t.bounds.width),0,t.bounds.width,0,360),s=this.value.rawValue,[,r,o,a]=s.getComponents("hsv");this.value.setRawValue(new Jt([i,r,o,a],"hsv"),e)}onPointerDown_(t){this.handlePointerEvent_(t.data,{forceEmit:!1,last:!1})}onPointerMove_(t){this.handlePointerEvent_(t.data,{forceEmit:!1,last:!1})}onPointerUp_(t){this.handlePointerEvent_(t.data,{forceEmit:!0,last:!0})}onKeyDown_(t){const e=on(ls(!1),vi(t));if(e===0)return;const i=this.value.rawValue,[s,r,o,a]=i.getComponents("hsv");this.value.setRawValue(new Jt([s+e,r,o,a],"hsv"),{forceEmit:!1,last:!1})}onKeyUp_(t){on(ls(!1),vi(t))!==0&&this.value.setRawValue(this.value.rawValue,{forceEmit:!0,last:!0})}}const Ul=jt("svp"),Tp=64;class cP{constructor(t,e){this.onValueChange_=this.onValueChange_.bind(this),this.value=e.value,this.value.emitter.on("change",this.onValueChange_),this.element=t.createElement("div"),this.element.classList.add(Ul()),e.viewProps.bindClassModifiers(this.element),e.viewProps.bindTabIndex(this.element);const i=t.createElement("canvas");i.height=Tp,i.width=Tp,i.classList.add(Ul("c")),this.element.appendChild(i),this.canvasElement=i;const s=t.createElement("div");s.classList.add(Ul("m")),this.element.appendChild(s),this.markerElem_=s,this.update_()}update_(){const t=lR(this.canvasElement);if(!t)return;const i=this.value.rawValue.getComponents("hsv"),s=this.canvasElement.width,r=this.canvasElement.height,o=t.getImageData(0,0,s,r),a=o.data;for(let h=0;h<r;h++)for(let d=0;d<s;d++){const u=ne(d,0,s,0,100),p=ne(h,0,r,100,0),g=Ng(i[0],u,p),x=(h*s+d)*4;a[x]=g[0],a[x+1]=g[1],a[x+2]=g[2],a[x+3]=255}t.putImageData(o,0,0);const l=ne(i[1],0,100,0,100);this.markerElem_.style.left=`${l}%`;const c=ne(i[2],0,100,100,0);this.markerElem_.style.top=`${c}%`}onValueChange_(){this.update_()}}class hP{constructor(t,e){this.onKeyDown_=this.onKeyDown_.bind(this),this.onKeyUp_=this.onKeyUp_.bind(this),this.onPointerDown_=this.onPointerDown_.bind(this),this.onPointerMove_=this.onPointerMove_.bind(this),this.onPointerUp_=this.onPointerUp_.bind(this),this.value=e.value,this.viewProps=e.viewProps,this.view=new cP(t,{value:this.value,viewProps:this.viewProps}),this.ptHandler_=new us(this.view.element),this.ptHandler_.emitter.on("down",this.onPointerDown_),this.ptHandler_.emitter.on("move",this.onPointerMove_),this.ptHandler_.emitter.on("up",this.onPointerUp_),this.view.element.addEventListener("keydown",this.onKeyDown_),this.view.element.addEventListener("keyup",this.onKeyUp_)}handlePointerEvent_(t,e){if(!t.point)return;const i=ne(t.point.x,0,t.bounds.width,0,100),s=ne(t.point.y,0,t.bounds.height,100,0),[r,,,o]=this.value.rawValue.getComponents("hsv");this.value.setRawValue(new Jt([r,i,s,o],"hsv"),e)}onPointerDown_(t){this.handlePointerEvent_(t.data,{forceEmit:!1,last:!1})}onPointerMove_(t){this.handlePointerEvent_(t.data,{forceEmit:!1,last:!1})}onPointerUp_(t){this.handlePointerEvent_(t.data,{forceEmit:!0,last:!0})}onKeyDown_(t){Pg(t.key)&&t.preventDefault();const[e,i,s,r]=this.value.rawValue.getComponents("hsv"),o=ls(!1),a=on(o,vi(t)),l=on(o,Gr(t));a===0&&l===0||this.value.setRawValue(new Jt([e,i+a,s+l,r],"hsv"),{forceEmit:!1,last:!1})}onKeyUp_(t){const e=ls(!1),i=on(e,vi(t)),s=on(e,Gr(t));i===0&&s===0||this.value.setRawValue(this.value.rawValue,{forceEmit:!0,last:!0})}}class uP{constructor(t,e){this.value=e.value,this.viewProps=e.viewProps,this.hPaletteC_=new lP(t,{value:this.value,viewProps:this.viewProps}),this.svPaletteC_=new hP(t,{value:this.value,viewProps:this.viewProps}),this.alphaIcs_=e.supportsAlpha?{palette:new j2(t,{value:this.value,viewProps:this.viewProps}),text:new io(t,{parser:gi,props:Vt.fromObject({pointerScale:.01,keyScale:.1,formatter:ln(2)}),value:ge(0,{constraint:new jr({min:0,max:1})}),viewProps:this.viewProps})}:null,this.alphaIcs_&&ir({primary:this.value,secondary:this.alphaIcs_.text.value,forward:i=>i.getComponents()[3],backward:(i,s)=>{const r=i.getComponents();return r[3]=s,new Jt(r,i.mode)}}),this.textsC_=new oP(t,{colorType:e.colorType,value:this.value,viewProps:this.viewProps}),this.view=new E2(t,{alphaViews:this.alphaIcs_?{palette:this.alphaIcs_.palette.view,text:this.alphaIcs_.text.view}:null,hPaletteView:this.hPaletteC_.view,supportsAlpha:e.supportsAlpha,svPaletteView:this.svPaletteC_.view,textsView:this.textsC_.view,viewProps:this.viewProps})}get textsController(){return this.textsC_}}const Ol=jt("colsw");class dP{constructor(t,e){this.onValueChange_=this.onValueChange_.bind(this),e.value.emitter.on("change",this.onValueChange_),this.value=e.value,this.element=t.createElement("div"),this.element.classList.add(Ol()),e.viewProps.bindClassModifiers(this.element);const i=t.createElement("div");i.classList.add(Ol("sw")),this.element.appendChild(i),this.swatchElem_=i;const s=t.createElement("button");s.classList.add(Ol("b")),e.viewProps.bindDisabled(s),this.element.appendChild(s),this.buttonElement=s,this.update_()}update_(){const t=this.value.rawValue;this.swatchElem_.style.backgroundColor=qh(t)}onValueChange_(){this.update_()}}class pP{constructor(t,e){this.value=e.value,this.viewProps=e.viewProps,this.view=new dP(t,{value:this.value,viewProps:this.viewProps})}}class $h{constructor(t,e){this.onButtonBlur_=this.onButtonBlur_.bind(this),this.onButtonClick_=this.onButtonClick_.bind(this),this.onPopupChildBlur_=this.onPopupChildBlur_.bind(this),this.onPopupChildKeydown_=this.onPopupChildKeydown_.bind(this),this.value=e.value,this.viewProps=e.viewProps,this.foldable_=Jr.create(e.expanded),this.swatchC_=new pP(t,{value:this.value,viewProps:this.viewProps});const i=this.swatchC_.view.buttonElement;i.addEventListener("blur",this.onButtonBlur_),i.addEventListener("click",this.onButtonClick_),this.textC_=new Hr(t,{parser:e.parser,props:Vt.fromObject({formatter:e.formatter}),value:this.value,viewProps:this.viewProps}),this.view=new g2(t,{foldable:this.foldable_,pickerLayout:e.pickerLayout}),this.view.swatchElement.appendChild(this.swatchC_.view.element),this.view.textElement.appendChild(this.textC_.view.element),this.popC_=e.pickerLayout==="popup"?new Ag(t,{viewProps:this.viewProps}):null;const s=new uP(t,{colorType:e.colorType,supportsAlpha:e.supportsAlpha,value:this.value,viewProps:this.viewProps});s.view.allFocusableElements.forEach(r=>{r.addEventListener("blur",this.onPopupChildBlur_),r.addEventListener("keydown",this.onPopupChildKeydown_)}),this.pickerC_=s,this.popC_?(this.view.element.appendChild(this.popC_.view.element),this.popC_.view.element.appendChild(s.view.element),ir({primary:this.foldable_.value("expanded"),secondary:this.popC_.shows,forward:r=>r,backward:(r,o)=>o})):this.view.pickerElement&&(this.view.pickerElement.appendChild(this.pickerC_.view.element),kh(this.foldable_,this.view.pickerElement))}get textController(){return this.textC_}onButtonBlur_(t){if(!this.popC_)return;const e=this.view.element,i=t.relatedTarget;(!i||!e.contains(i))&&(this.popC_.shows.rawValue=!1)}onButtonClick_(){this.foldable_.set("expanded",!this.foldable_.get("expanded")),this.foldable_.get("expanded")&&this.pickerC_.view.allFocusableElements[0].focus()}onPopupChildBlur_(t){if(!this.popC_)return;const e=this.popC_.view.element,i=_g(t);i&&e.contains(i)||i&&i===this.swatchC_.view.buttonElement&&!Dh(e.ownerDocument)||(this.popC_.shows.rawValue=!1)}onPopupChildKeydown_(t){this.popC_?t.key==="Escape"&&(this.popC_.shows.rawValue=!1):this.view.pickerElement&&t.key==="Escape"&&this.swatchC_.view.buttonElement.focus()}}function fP(n){return Qn(n.getComponents("rgb")).reduce((t,e)=>t<<8|Math.floor(e)&255,0)}function mP(n){return n.getComponents("rgb").reduce((t,e,i)=>{const s=Math.floor(i===3?e*255:e)&255;return t<<8|s},0)>>>0}function gP(n){return new Jt([n>>16&255,n>>8&255,n&255],"rgb")}function vP(n){return new Jt([n>>24&255,n>>16&255,n>>8&255,ne(n&255,0,255,0,1)],"rgb")}function _P(n){return typeof n!="number"?Jt.black():gP(n)}function xP(n){return typeof n!="number"?Jt.black():vP(n)}function ra(n,t){return typeof n!="object"||ue(n)?!1:t in n&&typeof n[t]=="number"}function Qg(n){return ra(n,"r")&&ra(n,"g")&&ra(n,"b")}function Jg(n){return Qg(n)&&ra(n,"a")}function t0(n){return Qg(n)}function Yh(n,t){if(n.mode!==t.mode||n.type!==t.type)return!1;const e=n.getComponents(),i=t.getComponents();for(let s=0;s<e.length;s++)if(e[s]!==i[s])return!1;return!0}function Ap(n){return"a"in n?[n.r,n.g,n.b,n.a]:[n.r,n.g,n.b]}function bP(n){const t=jg(n);return t?(e,i)=>{so(e,t(i))}:null}function wP(n){const t=n?mP:fP;return(e,i)=>{so(e,t(i))}}function yP(n,t,e){const s=en(t,e).toRgbaObject();n.writeProperty("r",s.r),n.writeProperty("g",s.g),n.writeProperty("b",s.b),n.writeProperty("a",s.a)}function SP(n,t,e){const s=en(t,e).toRgbaObject();n.writeProperty("r",s.r),n.writeProperty("g",s.g),n.writeProperty("b",s.b)}function EP(n,t){return(e,i)=>{n?yP(e,i,t):SP(e,i,t)}}function MP(n){var t;return!!(!((t=n?.color)===null||t===void 0)&&t.alpha)}function TP(n){return n?t=>qh(t,"0x"):t=>Xh(t,"0x")}function AP(n){return"color"in n||n.view==="color"}const CP=nn({id:"input-color-number",type:"input",accept:(n,t)=>{if(typeof n!="number"||!AP(t))return null;const e=Hh(t);return e?{initialValue:n,params:Object.assign(Object.assign({},e),{supportsAlpha:MP(t)})}:null},binding:{reader:n=>n.params.supportsAlpha?xP:_P,equals:Yh,writer:n=>wP(n.params.supportsAlpha)},controller:n=>{var t,e;return new $h(n.document,{colorType:"int",expanded:(t=n.params.expanded)!==null&&t!==void 0?t:!1,formatter:TP(n.params.supportsAlpha),parser:ro("int"),pickerLayout:(e=n.params.picker)!==null&&e!==void 0?e:"popup",supportsAlpha:n.params.supportsAlpha,value:n.value,viewProps:n.viewProps})}});function RP(n,t){if(!t0(n))return en(Jt.black(),t);if(t==="int"){const e=Ap(n);return new Jt(e,"rgb")}if(t==="float"){const e=Ap(n);return new Gh(e,"rgb")}return en(Jt.black(),"int")}function PP(n){return Jg(n)}function LP(n){return t=>{const e=RP(t,n);return en(e,"int")}}function DP(n,t){return e=>n?Zg(e,t):Kg(e,t)}const IP=nn({id:"input-color-object",type:"input",accept:(n,t)=>{var e;if(!t0(n))return null;const i=Hh(t);return i?{initialValue:n,params:Object.assign(Object.assign({},i),{colorType:(e=Fg(t))!==null&&e!==void 0?e:"int"})}:null},binding:{reader:n=>LP(n.params.colorType),equals:Yh,writer:n=>EP(PP(n.initialValue),n.params.colorType)},controller:n=>{var t,e;const i=Jg(n.initialValue);return new $h(n.document,{colorType:n.params.colorType,expanded:(t=n.params.expanded)!==null&&t!==void 0?t:!1,formatter:DP(i,n.params.colorType),parser:ro("int"),pickerLayout:(e=n.params.picker)!==null&&e!==void 0?e:"popup",supportsAlpha:i,value:n.value,viewProps:n.viewProps})}}),NP=nn({id:"input-color-string",type:"input",accept:(n,t)=>{if(typeof n!="string"||t.view==="text")return null;const e=G2(n,Fg(t));if(!e)return null;const i=jg(e);if(!i)return null;const s=Hh(t);return s?{initialValue:n,params:Object.assign(Object.assign({},s),{format:e,stringifier:i})}:null},binding:{reader:()=>W2,equals:Yh,writer:n=>{const t=bP(n.params.format);if(!t)throw ye.notBindable();return t}},controller:n=>{var t,e;return new $h(n.document,{colorType:n.params.format.type,expanded:(t=n.params.expanded)!==null&&t!==void 0?t:!1,formatter:n.params.stringifier,parser:ro("int"),pickerLayout:(e=n.params.picker)!==null&&e!==void 0?e:"popup",supportsAlpha:n.params.format.alpha,value:n.value,viewProps:n.viewProps})}});class Kh{constructor(t){this.components=t.components,this.asm_=t.assembly}constrain(t){const e=this.asm_.toComponents(t).map((i,s)=>{var r,o;return(o=(r=this.components[s])===null||r===void 0?void 0:r.constrain(i))!==null&&o!==void 0?o:i});return this.asm_.fromComponents(e)}}const Cp=jt("pndtxt");class UP{constructor(t,e){this.textViews=e.textViews,this.element=t.createElement("div"),this.element.classList.add(Cp()),this.textViews.forEach(i=>{const s=t.createElement("div");s.classList.add(Cp("a")),s.appendChild(i.element),this.element.appendChild(s)})}}function OP(n,t,e){return new io(n,{arrayPosition:e===0?"fst":e===t.axes.length-1?"lst":"mid",parser:t.parser,props:t.axes[e].textProps,value:ge(0,{constraint:t.axes[e].constraint}),viewProps:t.viewProps})}class Zh{constructor(t,e){this.value=e.value,this.viewProps=e.viewProps,this.acs_=e.axes.map((i,s)=>OP(t,e,s)),this.acs_.forEach((i,s)=>{ir({primary:this.value,secondary:i.value,forward:r=>e.assembly.toComponents(r)[s],backward:(r,o)=>{const a=e.assembly.toComponents(r);return a[s]=o,e.assembly.fromComponents(a)}})}),this.view=new UP(t,{textViews:this.acs_.map(i=>i.view)})}get textControllers(){return this.acs_}}class FP extends Vr{get max(){return this.controller.valueController.sliderController.props.get("max")}set max(t){this.controller.valueController.sliderController.props.set("max",t)}get min(){return this.controller.valueController.sliderController.props.get("min")}set min(t){this.controller.valueController.sliderController.props.set("min",t)}}function kP(n,t){const e=[],i=ug(n,t);i&&e.push(i);const s=dg(n);s&&e.push(s);const r=Vh(n.options);return r&&e.push(r),new to(e)}const BP=nn({id:"input-number",type:"input",accept:(n,t)=>{if(typeof n!="number")return null;const e=be(t,i=>Object.assign(Object.assign({},fg(i)),{options:i.optional.custom(no),readonly:i.optional.constant(!1)}));return e?{initialValue:n,params:e}:null},binding:{reader:n=>ag,constraint:n=>kP(n.params,n.initialValue),writer:n=>so},controller:n=>{const t=n.value,e=n.constraint,i=e&&Ea(e,eo);if(i)return new Hi(n.document,{props:new Vt({options:i.values.value("options")}),value:t,viewProps:n.viewProps});const s=pg(n.params,t.rawValue),r=e&&Ea(e,jr);return r?new Ta(n.document,Object.assign(Object.assign({},Lg(Object.assign(Object.assign({},s),{keyScale:ge(s.keyScale),max:r.values.value("max"),min:r.values.value("min")}))),{parser:gi,value:t,viewProps:n.viewProps})):new io(n.document,{parser:gi,props:Vt.fromObject(s),value:t,viewProps:n.viewProps})},api(n){return typeof n.controller.value.rawValue!="number"?null:n.controller.valueController instanceof Ta?new FP(n.controller):n.controller.valueController instanceof Hi?new Bh(n.controller):null}});class ki{constructor(t=0,e=0){this.x=t,this.y=e}getComponents(){return[this.x,this.y]}static isObject(t){if(ue(t))return!1;const e=t.x,i=t.y;return!(typeof e!="number"||typeof i!="number")}static equals(t,e){return t.x===e.x&&t.y===e.y}toObject(){return{x:this.x,y:this.y}}}const e0={toComponents:n=>n.getComponents(),fromComponents:n=>new ki(...n)},Ts=jt("p2d");class zP{constructor(t,e){this.element=t.createElement("div"),this.element.classList.add(Ts()),e.viewProps.bindClassModifiers(this.element),di(e.expanded,tr(this.element,Ts(void 0,"expanded")));const i=t.createElement("div");i.classList.add(Ts("h")),this.element.appendChild(i);const s=t.createElement("button");s.classList.add(Ts("b")),s.appendChild(Fa(t,"p2dpad")),e.viewProps.bindDisabled(s),i.appendChild(s),this.buttonElement=s;const r=t.createElement("div");if(r.classList.add(Ts("t")),i.appendChild(r),this.textElement=r,e.pickerLayout==="inline"){const o=t.createElement("div");o.classList.add(Ts("p")),this.element.appendChild(o),this.pickerElement=o}else this.pickerElement=null}}const Pi=jt("p2dp");class VP{constructor(t,e){this.onFoldableChange_=this.onFoldableChange_.bind(this),this.onPropsChange_=this.onPropsChange_.bind(this),this.onValueChange_=this.onValueChange_.bind(this),this.props_=e.props,this.props_.emitter.on("change",this.onPropsChange_),this.element=t.createElement("div"),this.element.classList.add(Pi()),e.layout==="popup"&&this.element.classList.add(Pi(void 0,"p")),e.viewProps.bindClassModifiers(this.element);const i=t.createElement("div");i.classList.add(Pi("p")),e.viewProps.bindTabIndex(i),this.element.appendChild(i),this.padElement=i;const s=t.createElementNS(qn,"svg");s.classList.add(Pi("g")),this.padElement.appendChild(s),this.svgElem_=s;const r=t.createElementNS(qn,"line");r.classList.add(Pi("ax")),r.setAttributeNS(null,"x1","0"),r.setAttributeNS(null,"y1","50%"),r.setAttributeNS(null,"x2","100%"),r.setAttributeNS(null,"y2","50%"),this.svgElem_.appendChild(r);const o=t.createElementNS(qn,"line");o.classList.add(Pi("ax")),o.setAttributeNS(null,"x1","50%"),o.setAttributeNS(null,"y1","0"),o.setAttributeNS(null,"x2","50%"),o.setAttributeNS(null,"y2","100%"),this.svgElem_.appendChild(o);const a=t.createElementNS(qn,"line");a.classList.add(Pi("l")),a.setAttributeNS(null,"x1","50%"),a.setAttributeNS(null,"y1","50%"),this.svgElem_.appendChild(a),this.lineElem_=a;const l=t.createElement("div");l.classList.add(Pi("m")),this.padElement.appendChild(l),this.markerElem_=l,e.value.emitter.on("change",this.onValueChange_),this.value=e.value,this.update_()}get allFocusableElements(){return[this.padElement]}update_(){const[t,e]=this.value.rawValue.getComponents(),i=this.props_.get("max"),s=ne(t,-i,+i,0,100),r=ne(e,-i,+i,0,100),o=this.props_.get("invertsY")?100-r:r;this.lineElem_.setAttributeNS(null,"x2",`${s}%`),this.lineElem_.setAttributeNS(null,"y2",`${o}%`),this.markerElem_.style.left=`${s}%`,this.markerElem_.style.top=`${o}%`}onValueChange_(){this.update_()}onPropsChange_(){this.update_()}onFoldableChange_(){this.update_()}}function Rp(n,t,e){return[on(t[0],vi(n)),on(t[1],Gr(n))*(e?1:-1)]}class HP{constructor(t,e){this.onPadKeyDown_=this.onPadKeyDown_.bind(this),this.onPadKeyUp_=this.onPadKeyUp_.bind(this),this.onPointerDown_=this.onPointerDown_.bind(this),this.onPointerMove_=this.onPointerMove_.bind(this),this.onPointerUp_=this.onPointerUp_.bind(this),this.props=e.props,this.value=e.value,this.viewProps=e.viewProps,this.view=new VP(t,{layout:e.layout,props:this.props,value:this.value,viewProps:this.viewProps}),this.ptHandler_=new us(this.view.padElement),this.ptHandler_.emitter.on("down",this.onPointerDown_),this.ptHandler_.emitter.on("move",this.onPointerMove_),this.ptHandler_.emitter.on("up",this.onPointerUp_),this.view.padElement.addEventListener("keydown",this.onPadKeyDown_),this.view.padElement.addEventListener("keyup",this.onPadKeyUp_)}handlePointerEvent_(t,e){if(!t.point)return;const i=this.props.get("max"),s=ne(t.point.x,0,t.bounds.width,-i,+i),r=ne(this.props.get("invertsY")?t.bounds.height-t.point.y:t.point.y,0,t.bounds.height,-i,+i);this.value.setRawValue(new ki(s,r),e)}onPointerDown_(t){this.handlePointerEvent_(t.data,{forceEmit:!1,last:!1})}onPointerMove_(t){this.handlePointerEvent_(t.data,{forceEmit:!1,last:!1})}onPointerUp_(t){this.handlePointerEvent_(t.data,{forceEmit:!0,last:!0})}onPadKeyDown_(t){Pg(t.key)&&t.preventDefault();const[e,i]=Rp(t,[this.props.get("xKeyScale"),this.props.get("yKeyScale")],this.props.get("invertsY"));e===0&&i===0||this.value.setRawValue(new ki(this.value.rawValue.x+e,this.value.rawValue.y+i),{forceEmit:!1,last:!1})}onPadKeyUp_(t){const[e,i]=Rp(t,[this.props.get("xKeyScale"),this.props.get("yKeyScale")],this.props.get("invertsY"));e===0&&i===0||this.value.setRawValue(this.value.rawValue,{forceEmit:!0,last:!0})}}class GP{constructor(t,e){var i,s;this.onPopupChildBlur_=this.onPopupChildBlur_.bind(this),this.onPopupChildKeydown_=this.onPopupChildKeydown_.bind(this),this.onPadButtonBlur_=this.onPadButtonBlur_.bind(this),this.onPadButtonClick_=this.onPadButtonClick_.bind(this),this.value=e.value,this.viewProps=e.viewProps,this.foldable_=Jr.create(e.expanded),this.popC_=e.pickerLayout==="popup"?new Ag(t,{viewProps:this.viewProps}):null;const r=new HP(t,{layout:e.pickerLayout,props:new Vt({invertsY:ge(e.invertsY),max:ge(e.max),xKeyScale:e.axes[0].textProps.value("keyScale"),yKeyScale:e.axes[1].textProps.value("keyScale")}),value:this.value,viewProps:this.viewProps});r.view.allFocusableElements.forEach(o=>{o.addEventListener("blur",this.onPopupChildBlur_),o.addEventListener("keydown",this.onPopupChildKeydown_)}),this.pickerC_=r,this.textC_=new Zh(t,{assembly:e0,axes:e.axes,parser:e.parser,value:this.value,viewProps:this.viewProps}),this.view=new zP(t,{expanded:this.foldable_.value("expanded"),pickerLayout:e.pickerLayout,viewProps:this.viewProps}),this.view.textElement.appendChild(this.textC_.view.element),(i=this.view.buttonElement)===null||i===void 0||i.addEventListener("blur",this.onPadButtonBlur_),(s=this.view.buttonElement)===null||s===void 0||s.addEventListener("click",this.onPadButtonClick_),this.popC_?(this.view.element.appendChild(this.popC_.view.element),this.popC_.view.element.appendChild(this.pickerC_.view.element),ir({primary:this.foldable_.value("expanded"),secondary:this.popC_.shows,forward:o=>o,backward:(o,a)=>a})):this.view.pickerElement&&(this.view.pickerElement.appendChild(this.pickerC_.view.element),kh(this.foldable_,this.view.pickerElement))}get textController(){return this.textC_}onPadButtonBlur_(t){if(!this.popC_)return;const e=this.view.element,i=t.relatedTarget;(!i||!e.contains(i))&&(this.popC_.shows.rawValue=!1)}onPadButtonClick_(){this.foldable_.set("expanded",!this.foldable_.get("expanded")),this.foldable_.get("expanded")&&this.pickerC_.view.allFocusableElements[0].focus()}onPopupChildBlur_(t){if(!this.popC_)return;const e=this.popC_.view.element,i=_g(t);i&&e.contains(i)||i&&i===this.view.buttonElement&&!Dh(e.ownerDocument)||(this.popC_.shows.rawValue=!1)}onPopupChildKeydown_(t){this.popC_?t.key==="Escape"&&(this.popC_.shows.rawValue=!1):this.view.pickerElement&&t.key==="Escape"&&this.view.buttonElement.focus()}}function WP(n){return ki.isObject(n)?new ki(n.x,n.y):new ki}function XP(n,t){n.writeProperty("x",t.x),n.writeProperty("y",t.y)}function qP(n,t){return new Kh({assembly:e0,components:[li(Object.assign(Object.assign({},n),n.x),t.x),li(Object.assign(Object.assign({},n),n.y),t.y)]})}function Pp(n,t){var e,i;if(!ue(n.min)||!ue(n.max))return Math.max(Math.abs((e=n.min)!==null&&e!==void 0?e:0),Math.abs((i=n.max)!==null&&i!==void 0?i:0));const s=cg(n);return Math.max(Math.abs(s)*10,Math.abs(t)*10)}function $P(n,t){var e,i;const s=Pp(os(n,(e=n.x)!==null&&e!==void 0?e:{}),t.x),r=Pp(os(n,(i=n.y)!==null&&i!==void 0?i:{}),t.y);return Math.max(s,r)}function YP(n){if(!("y"in n))return!1;const t=n.y;return t&&"inverted"in t?!!t.inverted:!1}const KP=nn({id:"input-point2d",type:"input",accept:(n,t)=>{if(!ki.isObject(n))return null;const e=be(t,i=>Object.assign(Object.assign({},Wr(i)),{expanded:i.optional.boolean,picker:i.optional.custom(Ig),readonly:i.optional.constant(!1),x:i.optional.custom(Fi),y:i.optional.object(Object.assign(Object.assign({},Wr(i)),{inverted:i.optional.boolean}))}));return e?{initialValue:n,params:e}:null},binding:{reader:()=>WP,constraint:n=>qP(n.params,n.initialValue),equals:ki.equals,writer:()=>XP},controller:n=>{var t,e;const i=n.document,s=n.value,r=n.constraint,o=[n.params.x,n.params.y];return new GP(i,{axes:s.rawValue.getComponents().map((a,l)=>{var c;return Lh({constraint:r.components[l],initialValue:a,params:os(n.params,(c=o[l])!==null&&c!==void 0?c:{})})}),expanded:(t=n.params.expanded)!==null&&t!==void 0?t:!1,invertsY:YP(n.params),max:$P(n.params,s.rawValue),parser:gi,pickerLayout:(e=n.params.picker)!==null&&e!==void 0?e:"popup",value:s,viewProps:n.viewProps})}});class Vs{constructor(t=0,e=0,i=0){this.x=t,this.y=e,this.z=i}getComponents(){return[this.x,this.y,this.z]}static isObject(t){if(ue(t))return!1;const e=t.x,i=t.y,s=t.z;return!(typeof e!="number"||typeof i!="number"||typeof s!="number")}static equals(t,e){return t.x===e.x&&t.y===e.y&&t.z===e.z}toObject(){return{x:this.x,y:this.y,z:this.z}}}const n0={toComponents:n=>n.getComponents(),fromComponents:n=>new Vs(...n)};function ZP(n){return Vs.isObject(n)?new Vs(n.x,n.y,n.z):new Vs}function jP(n,t){n.writeProperty("x",t.x),n.writeProperty("y",t.y),n.writeProperty("z",t.z)}function QP(n,t){return new Kh({assembly:n0,components:[li(Object.assign(Object.assign({},n),n.x),t.x),li(Object.assign(Object.assign({},n),n.y),t.y),li(Object.assign(Object.assign({},n),n.z),t.z)]})}const JP=nn({id:"input-point3d",type:"input",accept:(n,t)=>{if(!Vs.isObject(n))return null;const e=be(t,i=>Object.assign(Object.assign({},Wr(i)),{readonly:i.optional.constant(!1),x:i.optional.custom(Fi),y:i.optional.custom(Fi),z:i.optional.custom(Fi)}));return e?{initialValue:n,params:e}:null},binding:{reader:n=>ZP,constraint:n=>QP(n.params,n.initialValue),equals:Vs.equals,writer:n=>jP},controller:n=>{const t=n.value,e=n.constraint,i=[n.params.x,n.params.y,n.params.z];return new Zh(n.document,{assembly:n0,axes:t.rawValue.getComponents().map((s,r)=>{var o;return Lh({constraint:e.components[r],initialValue:s,params:os(n.params,(o=i[r])!==null&&o!==void 0?o:{})})}),parser:gi,value:t,viewProps:n.viewProps})}});class Hs{constructor(t=0,e=0,i=0,s=0){this.x=t,this.y=e,this.z=i,this.w=s}getComponents(){return[this.x,this.y,this.z,this.w]}static isObject(t){if(ue(t))return!1;const e=t.x,i=t.y,s=t.z,r=t.w;return!(typeof e!="number"||typeof i!="number"||typeof s!="number"||typeof r!="number")}static equals(t,e){return t.x===e.x&&t.y===e.y&&t.z===e.z&&t.w===e.w}toObject(){return{x:this.x,y:this.y,z:this.z,w:this.w}}}const i0={toComponents:n=>n.getComponents(),fromComponents:n=>new Hs(...n)};function t3(n){return Hs.isObject(n)?new Hs(n.x,n.y,n.z,n.w):new Hs}function e3(n,t){n.writeProperty("x",t.x),n.writeProperty("y",t.y),n.writeProperty("z",t.z),n.writeProperty("w",t.w)}function n3(n,t){return new Kh({assembly:i0,components:[li(Object.assign(Object.assign({},n),n.x),t.x),li(Object.assign(Object.assign({},n),n.y),t.y),li(Object.assign(Object.assign({},n),n.z),t.z),li(Object.assign(Object.assign({},n),n.w),t.w)]})}const i3=nn({id:"input-point4d",type:"input",accept:(n,t)=>{if(!Hs.isObject(n))return null;const e=be(t,i=>Object.assign(Object.assign({},Wr(i)),{readonly:i.optional.constant(!1),w:i.optional.custom(Fi),x:i.optional.custom(Fi),y:i.optional.custom(Fi),z:i.optional.custom(Fi)}));return e?{initialValue:n,params:e}:null},binding:{reader:n=>t3,constraint:n=>n3(n.params,n.initialValue),equals:Hs.equals,writer:n=>e3},controller:n=>{const t=n.value,e=n.constraint,i=[n.params.x,n.params.y,n.params.z,n.params.w];return new Zh(n.document,{assembly:i0,axes:t.rawValue.getComponents().map((s,r)=>{var o;return Lh({constraint:e.components[r],initialValue:s,params:os(n.params,(o=i[r])!==null&&o!==void 0?o:{})})}),parser:gi,value:t,viewProps:n.viewProps})}});function s3(n){const t=[],e=Vh(n.options);return e&&t.push(e),new to(t)}const r3=nn({id:"input-string",type:"input",accept:(n,t)=>{if(typeof n!="string")return null;const e=be(t,i=>({readonly:i.optional.constant(!1),options:i.optional.custom(no)}));return e?{initialValue:n,params:e}:null},binding:{reader:n=>Rg,constraint:n=>s3(n.params),writer:n=>so},controller:n=>{const t=n.document,e=n.value,i=n.constraint,s=i&&Ea(i,eo);return s?new Hi(t,{props:new Vt({options:s.values.value("options")}),value:e,viewProps:n.viewProps}):new Hr(t,{parser:r=>r,props:Vt.fromObject({formatter:Gc}),value:e,viewProps:n.viewProps})},api(n){return typeof n.controller.value.rawValue!="string"?null:n.controller.valueController instanceof Hi?new Bh(n.controller):null}}),oo={monitor:{defaultInterval:200,defaultRows:3}},Lp=jt("mll");class o3{constructor(t,e){this.onValueUpdate_=this.onValueUpdate_.bind(this),this.formatter_=e.formatter,this.element=t.createElement("div"),this.element.classList.add(Lp()),e.viewProps.bindClassModifiers(this.element);const i=t.createElement("textarea");i.classList.add(Lp("i")),i.style.height=`calc(var(${Dg("containerUnitSize")}) * ${e.rows})`,i.readOnly=!0,e.viewProps.bindDisabled(i),this.element.appendChild(i),this.textareaElem_=i,e.value.emitter.on("change",this.onValueUpdate_),this.value=e.value,this.update_()}update_(){const t=this.textareaElem_,e=t.scrollTop===t.scrollHeight-t.clientHeight,i=[];this.value.rawValue.forEach(s=>{s!==void 0&&i.push(this.formatter_(s))}),t.textContent=i.join(`
`),e&&(t.scrollTop=t.scrollHeight)}onValueUpdate_(){this.update_()}}class jh{constructor(t,e){this.value=e.value,this.viewProps=e.viewProps,this.view=new o3(t,{formatter:e.formatter,rows:e.rows,value:this.value,viewProps:this.viewProps})}}const Dp=jt("sgl");class a3{constructor(t,e){this.onValueUpdate_=this.onValueUpdate_.bind(this),this.formatter_=e.formatter,this.element=t.createElement("div"),this.element.classList.add(Dp()),e.viewProps.bindClassModifiers(this.element);const i=t.createElement("input");i.classList.add(Dp("i")),i.readOnly=!0,i.type="text",e.viewProps.bindDisabled(i),this.element.appendChild(i),this.inputElement=i,e.value.emitter.on("change",this.onValueUpdate_),this.value=e.value,this.update_()}update_(){const t=this.value.rawValue,e=t[t.length-1];this.inputElement.value=e!==void 0?this.formatter_(e):""}onValueUpdate_(){this.update_()}}class Qh{constructor(t,e){this.value=e.value,this.viewProps=e.viewProps,this.view=new a3(t,{formatter:e.formatter,value:this.value,viewProps:this.viewProps})}}const l3=nn({id:"monitor-bool",type:"monitor",accept:(n,t)=>{if(typeof n!="boolean")return null;const e=be(t,i=>({readonly:i.required.constant(!0),rows:i.optional.number}));return e?{initialValue:n,params:e}:null},binding:{reader:n=>Cg},controller:n=>{var t;return n.value.rawValue.length===1?new Qh(n.document,{formatter:Ep,value:n.value,viewProps:n.viewProps}):new jh(n.document,{formatter:Ep,rows:(t=n.params.rows)!==null&&t!==void 0?t:oo.monitor.defaultRows,value:n.value,viewProps:n.viewProps})}});class c3 extends Vr{get max(){return this.controller.valueController.props.get("max")}set max(t){this.controller.valueController.props.set("max",t)}get min(){return this.controller.valueController.props.get("min")}set min(t){this.controller.valueController.props.set("min",t)}}const Li=jt("grl");class h3{constructor(t,e){this.onCursorChange_=this.onCursorChange_.bind(this),this.onValueUpdate_=this.onValueUpdate_.bind(this),this.element=t.createElement("div"),this.element.classList.add(Li()),e.viewProps.bindClassModifiers(this.element),this.formatter_=e.formatter,this.props_=e.props,this.cursor_=e.cursor,this.cursor_.emitter.on("change",this.onCursorChange_);const i=t.createElementNS(qn,"svg");i.classList.add(Li("g")),i.style.height=`calc(var(${Dg("containerUnitSize")}) * ${e.rows})`,this.element.appendChild(i),this.svgElem_=i;const s=t.createElementNS(qn,"polyline");this.svgElem_.appendChild(s),this.lineElem_=s;const r=t.createElement("div");r.classList.add(Li("t"),jt("tt")()),this.element.appendChild(r),this.tooltipElem_=r,e.value.emitter.on("change",this.onValueUpdate_),this.value=e.value,this.update_()}get graphElement(){return this.svgElem_}update_(){const{clientWidth:t,clientHeight:e}=this.element,i=this.value.rawValue.length-1,s=this.props_.get("min"),r=this.props_.get("max"),o=[];this.value.rawValue.forEach((d,u)=>{if(d===void 0)return;const p=ne(u,0,i,0,t),g=ne(d,s,r,e,0);o.push([p,g].join(","))}),this.lineElem_.setAttributeNS(null,"points",o.join(" "));const a=this.tooltipElem_,l=this.value.rawValue[this.cursor_.rawValue];if(l===void 0){a.classList.remove(Li("t","a"));return}const c=ne(this.cursor_.rawValue,0,i,0,t),h=ne(l,s,r,e,0);a.style.left=`${c}px`,a.style.top=`${h}px`,a.textContent=`${this.formatter_(l)}`,a.classList.contains(Li("t","a"))||(a.classList.add(Li("t","a"),Li("t","in")),Sa(a),a.classList.remove(Li("t","in")))}onValueUpdate_(){this.update_()}onCursorChange_(){this.update_()}}class s0{constructor(t,e){if(this.onGraphMouseMove_=this.onGraphMouseMove_.bind(this),this.onGraphMouseLeave_=this.onGraphMouseLeave_.bind(this),this.onGraphPointerDown_=this.onGraphPointerDown_.bind(this),this.onGraphPointerMove_=this.onGraphPointerMove_.bind(this),this.onGraphPointerUp_=this.onGraphPointerUp_.bind(this),this.props=e.props,this.value=e.value,this.viewProps=e.viewProps,this.cursor_=ge(-1),this.view=new h3(t,{cursor:this.cursor_,formatter:e.formatter,rows:e.rows,props:this.props,value:this.value,viewProps:this.viewProps}),!Dh(t))this.view.element.addEventListener("mousemove",this.onGraphMouseMove_),this.view.element.addEventListener("mouseleave",this.onGraphMouseLeave_);else{const i=new us(this.view.element);i.emitter.on("down",this.onGraphPointerDown_),i.emitter.on("move",this.onGraphPointerMove_),i.emitter.on("up",this.onGraphPointerUp_)}}importProps(t){return pn(t,null,e=>({max:e.required.number,min:e.required.number}),e=>(this.props.set("max",e.max),this.props.set("min",e.min),!0))}exportProps(){return fn(null,{max:this.props.get("max"),min:this.props.get("min")})}onGraphMouseLeave_(){this.cursor_.rawValue=-1}onGraphMouseMove_(t){const{clientWidth:e}=this.view.element;this.cursor_.rawValue=Math.floor(ne(t.offsetX,0,e,0,this.value.rawValue.length))}onGraphPointerDown_(t){this.onGraphPointerMove_(t)}onGraphPointerMove_(t){if(!t.data.point){this.cursor_.rawValue=-1;return}this.cursor_.rawValue=Math.floor(ne(t.data.point.x,0,t.data.bounds.width,0,this.value.rawValue.length))}onGraphPointerUp_(){this.cursor_.rawValue=-1}}function Wc(n){return ue(n.format)?ln(2):n.format}function u3(n){var t;return n.value.rawValue.length===1?new Qh(n.document,{formatter:Wc(n.params),value:n.value,viewProps:n.viewProps}):new jh(n.document,{formatter:Wc(n.params),rows:(t=n.params.rows)!==null&&t!==void 0?t:oo.monitor.defaultRows,value:n.value,viewProps:n.viewProps})}function d3(n){var t,e,i;return new s0(n.document,{formatter:Wc(n.params),rows:(t=n.params.rows)!==null&&t!==void 0?t:oo.monitor.defaultRows,props:Vt.fromObject({max:(e=n.params.max)!==null&&e!==void 0?e:100,min:(i=n.params.min)!==null&&i!==void 0?i:0}),value:n.value,viewProps:n.viewProps})}function Ip(n){return n.view==="graph"}const p3=nn({id:"monitor-number",type:"monitor",accept:(n,t)=>{if(typeof n!="number")return null;const e=be(t,i=>({format:i.optional.function,max:i.optional.number,min:i.optional.number,readonly:i.required.constant(!0),rows:i.optional.number,view:i.optional.string}));return e?{initialValue:n,params:e}:null},binding:{defaultBufferSize:n=>Ip(n)?64:1,reader:n=>ag},controller:n=>Ip(n.params)?d3(n):u3(n),api:n=>n.controller.valueController instanceof s0?new c3(n.controller):null}),f3=nn({id:"monitor-string",type:"monitor",accept:(n,t)=>{if(typeof n!="string")return null;const e=be(t,i=>({multiline:i.optional.boolean,readonly:i.required.constant(!0),rows:i.optional.number}));return e?{initialValue:n,params:e}:null},binding:{reader:n=>Rg},controller:n=>{var t;const e=n.value;return e.rawValue.length>1||n.params.multiline?new jh(n.document,{formatter:Gc,rows:(t=n.params.rows)!==null&&t!==void 0?t:oo.monitor.defaultRows,value:e,viewProps:n.viewProps}):new Qh(n.document,{formatter:Gc,value:e,viewProps:n.viewProps})}});class m3{constructor(){this.map_=new Map}get(t){var e;return(e=this.map_.get(t))!==null&&e!==void 0?e:null}has(t){return this.map_.has(t)}add(t,e){return this.map_.set(t,e),t.viewProps.handleDispose(()=>{this.map_.delete(t)}),e}}class g3{constructor(t){this.target=t.target,this.reader_=t.reader,this.writer_=t.writer}read(){return this.reader_(this.target.read())}write(t){this.writer_(this.target,t)}inject(t){this.write(this.reader_(t))}}function v3(n,t){var e;const i=n.accept(t.target.read(),t.params);if(ue(i))return null;const s={target:t.target,initialValue:i.initialValue,params:i.params},r=be(t.params,d=>({disabled:d.optional.boolean,hidden:d.optional.boolean,label:d.optional.string,tag:d.optional.string})),o=n.binding.reader(s),a=n.binding.constraint?n.binding.constraint(s):void 0,l=new g3({reader:o,target:t.target,writer:n.binding.writer(s)}),c=new tR(ge(o(i.initialValue),{constraint:a,equals:n.binding.equals}),l),h=n.controller({constraint:a,document:t.document,initialValue:i.initialValue,params:i.params,value:c,viewProps:xi.create({disabled:r?.disabled,hidden:r?.hidden})});return new mR(t.document,{blade:nr(),props:Vt.fromObject({label:"label"in t.params?(e=r?.label)!==null&&e!==void 0?e:null:t.target.key}),tag:r?.tag,value:c,valueController:h})}class _3{constructor(t){this.target=t.target,this.reader_=t.reader}read(){return this.reader_(this.target.read())}}function x3(n,t){return t===0?new jR:new QR(n,t??oo.monitor.defaultInterval)}function b3(n,t){var e,i,s;const r=n.accept(t.target.read(),t.params);if(ue(r))return null;const o={target:t.target,initialValue:r.initialValue,params:r.params},a=be(t.params,u=>({bufferSize:u.optional.number,disabled:u.optional.boolean,hidden:u.optional.boolean,interval:u.optional.number,label:u.optional.string})),l=n.binding.reader(o),c=(i=(e=a?.bufferSize)!==null&&e!==void 0?e:n.binding.defaultBufferSize&&n.binding.defaultBufferSize(r.params))!==null&&i!==void 0?i:1,h=new bR({binding:new _3({reader:l,target:t.target}),bufferSize:c,ticker:x3(t.document,a?.interval)}),d=n.controller({document:t.document,params:r.params,value:h,viewProps:xi.create({disabled:a?.disabled,hidden:a?.hidden})});return d.viewProps.bindDisabled(h.ticker),d.viewProps.handleDispose(()=>{h.ticker.dispose()}),new yR(t.document,{blade:nr(),props:Vt.fromObject({label:"label"in t.params?(s=a?.label)!==null&&s!==void 0?s:null:t.target.key}),value:h,valueController:d})}class w3{constructor(t){this.pluginsMap_={blades:[],inputs:[],monitors:[]},this.apiCache_=t}getAll(){return[...this.pluginsMap_.blades,...this.pluginsMap_.inputs,...this.pluginsMap_.monitors]}register(t,e){if(!u2(e.core))throw ye.notCompatible(t,e.id);e.type==="blade"?this.pluginsMap_.blades.unshift(e):e.type==="input"?this.pluginsMap_.inputs.unshift(e):e.type==="monitor"&&this.pluginsMap_.monitors.unshift(e)}createInput_(t,e,i){return this.pluginsMap_.inputs.reduce((s,r)=>s??v3(r,{document:t,target:e,params:i}),null)}createMonitor_(t,e,i){return this.pluginsMap_.monitors.reduce((s,r)=>s??b3(r,{document:t,params:i,target:e}),null)}createBinding(t,e,i){const s=e.read();if(ue(s))throw new ye({context:{key:e.key},type:"nomatchingcontroller"});const r=this.createInput_(t,e,i);if(r)return r;const o=this.createMonitor_(t,e,i);if(o)return o;throw new ye({context:{key:e.key},type:"nomatchingcontroller"})}createBlade(t,e){const i=this.pluginsMap_.blades.reduce((s,r)=>s??ZR(r,{document:t,params:e}),null);if(!i)throw new ye({type:"nomatchingview",context:{params:e}});return i}createInputBindingApi_(t){const e=this.pluginsMap_.inputs.reduce((i,s)=>{var r,o;return i||((o=(r=s.api)===null||r===void 0?void 0:r.call(s,{controller:t}))!==null&&o!==void 0?o:null)},null);return this.apiCache_.add(t,e??new Vr(t))}createMonitorBindingApi_(t){const e=this.pluginsMap_.monitors.reduce((i,s)=>{var r,o;return i||((o=(r=s.api)===null||r===void 0?void 0:r.call(s,{controller:t}))!==null&&o!==void 0?o:null)},null);return this.apiCache_.add(t,e??new Vr(t))}createBindingApi(t){if(this.apiCache_.has(t))return this.apiCache_.get(t);if(gR(t))return this.createInputBindingApi_(t);if(SR(t))return this.createMonitorBindingApi_(t);throw ye.shouldNeverHappen()}createApi(t){if(this.apiCache_.has(t))return this.apiCache_.get(t);if(fR(t))return this.createBindingApi(t);const e=this.pluginsMap_.blades.reduce((i,s)=>i??s.api({controller:t,pool:this}),null);if(!e)throw ye.shouldNeverHappen();return this.apiCache_.add(t,e)}}const y3=new m3;function S3(){const n=new w3(y3);return[KP,JP,i3,r3,BP,NP,IP,CP,m2,l3,f3,p3,CR,VR,Tg].forEach(t=>{n.register("core",t)}),n}class E3 extends hs{constructor(t){super(t),this.emitter_=new Re,this.controller.value.emitter.on("change",e=>{this.emitter_.emit("change",new Qr(this,e.rawValue))})}get label(){return this.controller.labelController.props.get("label")}set label(t){this.controller.labelController.props.set("label",t)}get options(){return this.controller.valueController.props.get("options")}set options(t){this.controller.valueController.props.set("options",t)}get value(){return this.controller.value.rawValue}set value(t){this.controller.value.rawValue=t}on(t,e){const i=e.bind(this);return this.emitter_.on(t,s=>{i(s)},{key:e}),this}off(t,e){return this.emitter_.off(t,e),this}}class M3 extends hs{}class T3 extends hs{constructor(t){super(t),this.emitter_=new Re,this.controller.value.emitter.on("change",e=>{this.emitter_.emit("change",new Qr(this,e.rawValue))})}get label(){return this.controller.labelController.props.get("label")}set label(t){this.controller.labelController.props.set("label",t)}get max(){return this.controller.valueController.sliderController.props.get("max")}set max(t){this.controller.valueController.sliderController.props.set("max",t)}get min(){return this.controller.valueController.sliderController.props.get("min")}set min(t){this.controller.valueController.sliderController.props.set("min",t)}get value(){return this.controller.value.rawValue}set value(t){this.controller.value.rawValue=t}on(t,e){const i=e.bind(this);return this.emitter_.on(t,s=>{i(s)},{key:e}),this}off(t,e){return this.emitter_.off(t,e),this}}class A3 extends hs{constructor(t){super(t),this.emitter_=new Re,this.controller.value.emitter.on("change",e=>{this.emitter_.emit("change",new Qr(this,e.rawValue))})}get label(){return this.controller.labelController.props.get("label")}set label(t){this.controller.labelController.props.set("label",t)}get formatter(){return this.controller.valueController.props.get("formatter")}set formatter(t){this.controller.valueController.props.set("formatter",t)}get value(){return this.controller.value.rawValue}set value(t){this.controller.value.rawValue=t}on(t,e){const i=e.bind(this);return this.emitter_.on(t,s=>{i(s)},{key:e}),this}off(t,e){return this.emitter_.off(t,e),this}}const C3=(function(){return{id:"list",type:"blade",core:er,accept(n){const t=be(n,e=>({options:e.required.custom(no),value:e.required.raw,view:e.required.constant("list"),label:e.optional.string}));return t?{params:t}:null},controller(n){const t=new eo(zh(n.params.options)),e=ge(n.params.value,{constraint:t}),i=new Hi(n.document,{props:new Vt({options:t.values.value("options")}),value:e,viewProps:n.viewProps});return new as(n.document,{blade:n.blade,props:Vt.fromObject({label:n.params.label}),value:e,valueController:i})},api(n){return!(n.controller instanceof as)||!(n.controller.valueController instanceof Hi)?null:new E3(n.controller)}}})();class R3 extends Eg{constructor(t,e){super(t,e)}get element(){return this.controller.view.element}}class P3 extends Vc{constructor(t,e){super(t,{expanded:e.expanded,blade:e.blade,props:e.props,root:!0,viewProps:e.viewProps})}}const Np=jt("spr");class L3{constructor(t,e){this.element=t.createElement("div"),this.element.classList.add(Np()),e.viewProps.bindClassModifiers(this.element);const i=t.createElement("hr");i.classList.add(Np("r")),this.element.appendChild(i)}}class Up extends ka{constructor(t,e){super(Object.assign(Object.assign({},e),{view:new L3(t,{viewProps:e.viewProps})}))}}const D3={id:"separator",type:"blade",core:er,accept(n){const t=be(n,e=>({view:e.required.constant("separator")}));return t?{params:t}:null},controller(n){return new Up(n.document,{blade:n.blade,viewProps:n.viewProps})},api(n){return n.controller instanceof Up?new M3(n.controller):null}},I3={id:"slider",type:"blade",core:er,accept(n){const t=be(n,e=>({max:e.required.number,min:e.required.number,view:e.required.constant("slider"),format:e.optional.function,label:e.optional.string,value:e.optional.number}));return t?{params:t}:null},controller(n){var t,e;const i=(t=n.params.value)!==null&&t!==void 0?t:0,s=new jr({max:n.params.max,min:n.params.min}),r=ge(i,{constraint:s}),o=new Ta(n.document,Object.assign(Object.assign({},Lg({formatter:(e=n.params.format)!==null&&e!==void 0?e:KC,keyScale:ge(1),max:s.values.value("max"),min:s.values.value("min"),pointerScale:hg(n.params,i)})),{parser:gi,value:r,viewProps:n.viewProps}));return new as(n.document,{blade:n.blade,props:Vt.fromObject({label:n.params.label}),value:r,valueController:o})},api(n){return!(n.controller instanceof as)||!(n.controller.valueController instanceof Ta)?null:new T3(n.controller)}},N3=(function(){return{id:"text",type:"blade",core:er,accept(n){const t=be(n,e=>({parse:e.required.function,value:e.required.raw,view:e.required.constant("text"),format:e.optional.function,label:e.optional.string}));return t?{params:t}:null},controller(n){var t;const e=ge(n.params.value),i=new Hr(n.document,{parser:n.params.parse,props:Vt.fromObject({formatter:(t=n.params.format)!==null&&t!==void 0?t:(s=>String(s))}),value:e,viewProps:n.viewProps});return new as(n.document,{blade:n.blade,props:Vt.fromObject({label:n.params.label}),value:e,valueController:i})},api(n){return!(n.controller instanceof as)||!(n.controller.valueController instanceof Hr)?null:new A3(n.controller)}}})();function U3(n){const t=n.createElement("div");return t.classList.add(jt("dfw")()),n.body&&n.body.appendChild(t),t}function O3(n,t,e){if(n.querySelector(`style[data-tp-style=${t}]`))return;const i=n.createElement("style");i.dataset.tpStyle=t,i.textContent=e,n.head.appendChild(i)}class r0 extends R3{constructor(t){var e,i;const s=t??{},r=(e=s.document)!==null&&e!==void 0?e:aR(),o=S3(),a=new P3(r,{expanded:s.expanded,blade:nr(),props:Vt.fromObject({title:s.title}),viewProps:xi.create()});super(a,o),this.pool_=o,this.containerElem_=(i=s.container)!==null&&i!==void 0?i:U3(r),this.containerElem_.appendChild(this.element),this.doc_=r,this.usesDefaultWrapper_=!s.container,this.setUpDefaultPlugins_()}get document(){if(!this.doc_)throw ye.alreadyDisposed();return this.doc_}dispose(){const t=this.containerElem_;if(!t)throw ye.alreadyDisposed();if(this.usesDefaultWrapper_){const e=t.parentElement;e&&e.removeChild(t)}this.containerElem_=null,this.doc_=null,super.dispose()}registerPlugin(t){t.css&&O3(this.document,`plugin-${t.id}`,t.css),("plugin"in t?[t.plugin]:"plugins"in t?t.plugins:[]).forEach(i=>{this.pool_.register(t.id,i)})}setUpDefaultPlugins_(){this.registerPlugin({id:"default",css:'.tp-tbiv_b,.tp-coltxtv_ms,.tp-colswv_b,.tp-ckbv_i,.tp-sglv_i,.tp-mllv_i,.tp-grlv_g,.tp-txtv_i,.tp-p2dpv_p,.tp-colswv_sw,.tp-rotv_b,.tp-fldv_b,.tp-p2dv_b,.tp-btnv_b,.tp-lstv_s{-webkit-appearance:none;-moz-appearance:none;appearance:none;background-color:rgba(0,0,0,0);border-width:0;font-family:inherit;font-size:inherit;font-weight:inherit;margin:0;outline:none;padding:0}.tp-p2dv_b,.tp-btnv_b,.tp-lstv_s{background-color:var(--btn-bg);border-radius:var(--bld-br);color:var(--btn-fg);cursor:pointer;display:block;font-weight:bold;height:var(--cnt-usz);line-height:var(--cnt-usz);overflow:hidden;text-overflow:ellipsis;white-space:nowrap}.tp-p2dv_b:hover,.tp-btnv_b:hover,.tp-lstv_s:hover{background-color:var(--btn-bg-h)}.tp-p2dv_b:focus,.tp-btnv_b:focus,.tp-lstv_s:focus{background-color:var(--btn-bg-f)}.tp-p2dv_b:active,.tp-btnv_b:active,.tp-lstv_s:active{background-color:var(--btn-bg-a)}.tp-p2dv_b:disabled,.tp-btnv_b:disabled,.tp-lstv_s:disabled{opacity:.5}.tp-rotv_c>.tp-cntv.tp-v-lst,.tp-tbpv_c>.tp-cntv.tp-v-lst,.tp-fldv_c>.tp-cntv.tp-v-lst{margin-bottom:calc(-1*var(--cnt-vp))}.tp-rotv_c>.tp-fldv.tp-v-lst .tp-fldv_c,.tp-tbpv_c>.tp-fldv.tp-v-lst .tp-fldv_c,.tp-fldv_c>.tp-fldv.tp-v-lst .tp-fldv_c{border-bottom-left-radius:0}.tp-rotv_c>.tp-fldv.tp-v-lst .tp-fldv_b,.tp-tbpv_c>.tp-fldv.tp-v-lst .tp-fldv_b,.tp-fldv_c>.tp-fldv.tp-v-lst .tp-fldv_b{border-bottom-left-radius:0}.tp-rotv_c>*:not(.tp-v-fst),.tp-tbpv_c>*:not(.tp-v-fst),.tp-fldv_c>*:not(.tp-v-fst){margin-top:var(--cnt-usp)}.tp-rotv_c>.tp-sprv:not(.tp-v-fst),.tp-tbpv_c>.tp-sprv:not(.tp-v-fst),.tp-fldv_c>.tp-sprv:not(.tp-v-fst),.tp-rotv_c>.tp-cntv:not(.tp-v-fst),.tp-tbpv_c>.tp-cntv:not(.tp-v-fst),.tp-fldv_c>.tp-cntv:not(.tp-v-fst){margin-top:var(--cnt-vp)}.tp-rotv_c>.tp-sprv+*:not(.tp-v-hidden),.tp-tbpv_c>.tp-sprv+*:not(.tp-v-hidden),.tp-fldv_c>.tp-sprv+*:not(.tp-v-hidden),.tp-rotv_c>.tp-cntv+*:not(.tp-v-hidden),.tp-tbpv_c>.tp-cntv+*:not(.tp-v-hidden),.tp-fldv_c>.tp-cntv+*:not(.tp-v-hidden){margin-top:var(--cnt-vp)}.tp-rotv_c>.tp-sprv:not(.tp-v-hidden)+.tp-sprv,.tp-tbpv_c>.tp-sprv:not(.tp-v-hidden)+.tp-sprv,.tp-fldv_c>.tp-sprv:not(.tp-v-hidden)+.tp-sprv,.tp-rotv_c>.tp-cntv:not(.tp-v-hidden)+.tp-cntv,.tp-tbpv_c>.tp-cntv:not(.tp-v-hidden)+.tp-cntv,.tp-fldv_c>.tp-cntv:not(.tp-v-hidden)+.tp-cntv{margin-top:0}.tp-tbpv_c>.tp-cntv,.tp-fldv_c>.tp-cntv{margin-left:4px}.tp-tbpv_c>.tp-fldv>.tp-fldv_b,.tp-fldv_c>.tp-fldv>.tp-fldv_b{border-top-left-radius:var(--bld-br);border-bottom-left-radius:var(--bld-br)}.tp-tbpv_c>.tp-fldv.tp-fldv-expanded>.tp-fldv_b,.tp-fldv_c>.tp-fldv.tp-fldv-expanded>.tp-fldv_b{border-bottom-left-radius:0}.tp-tbpv_c .tp-fldv>.tp-fldv_c,.tp-fldv_c .tp-fldv>.tp-fldv_c{border-bottom-left-radius:var(--bld-br)}.tp-tbpv_c>.tp-cntv+.tp-fldv>.tp-fldv_b,.tp-fldv_c>.tp-cntv+.tp-fldv>.tp-fldv_b{border-top-left-radius:0}.tp-tbpv_c>.tp-cntv+.tp-tabv>.tp-tabv_t,.tp-fldv_c>.tp-cntv+.tp-tabv>.tp-tabv_t{border-top-left-radius:0}.tp-tbpv_c>.tp-tabv>.tp-tabv_t,.tp-fldv_c>.tp-tabv>.tp-tabv_t{border-top-left-radius:var(--bld-br)}.tp-tbpv_c .tp-tabv>.tp-tabv_c,.tp-fldv_c .tp-tabv>.tp-tabv_c{border-bottom-left-radius:var(--bld-br)}.tp-rotv_b,.tp-fldv_b{background-color:var(--cnt-bg);color:var(--cnt-fg);cursor:pointer;display:block;height:calc(var(--cnt-usz) + 4px);line-height:calc(var(--cnt-usz) + 4px);overflow:hidden;padding-left:var(--cnt-hp);padding-right:calc(4px + var(--cnt-usz) + var(--cnt-hp));position:relative;text-align:left;text-overflow:ellipsis;white-space:nowrap;width:100%;transition:border-radius .2s ease-in-out .2s}.tp-rotv_b:hover,.tp-fldv_b:hover{background-color:var(--cnt-bg-h)}.tp-rotv_b:focus,.tp-fldv_b:focus{background-color:var(--cnt-bg-f)}.tp-rotv_b:active,.tp-fldv_b:active{background-color:var(--cnt-bg-a)}.tp-rotv_b:disabled,.tp-fldv_b:disabled{opacity:.5}.tp-rotv_m,.tp-fldv_m{background:linear-gradient(to left, var(--cnt-fg), var(--cnt-fg) 2px, transparent 2px, transparent 4px, var(--cnt-fg) 4px);border-radius:2px;bottom:0;content:"";display:block;height:6px;right:calc(var(--cnt-hp) + (var(--cnt-usz) + 4px - 6px)/2 - 2px);margin:auto;opacity:.5;position:absolute;top:0;transform:rotate(90deg);transition:transform .2s ease-in-out;width:6px}.tp-rotv.tp-rotv-expanded .tp-rotv_m,.tp-fldv.tp-fldv-expanded>.tp-fldv_b>.tp-fldv_m{transform:none}.tp-rotv_c,.tp-fldv_c{box-sizing:border-box;height:0;opacity:0;overflow:hidden;padding-bottom:0;padding-top:0;position:relative;transition:height .2s ease-in-out,opacity .2s linear,padding .2s ease-in-out}.tp-rotv.tp-rotv-cpl:not(.tp-rotv-expanded) .tp-rotv_c,.tp-fldv.tp-fldv-cpl:not(.tp-fldv-expanded)>.tp-fldv_c{display:none}.tp-rotv.tp-rotv-expanded .tp-rotv_c,.tp-fldv.tp-fldv-expanded>.tp-fldv_c{opacity:1;padding-bottom:var(--cnt-vp);padding-top:var(--cnt-vp);transform:none;overflow:visible;transition:height .2s ease-in-out,opacity .2s linear .2s,padding .2s ease-in-out}.tp-txtv_i,.tp-p2dpv_p,.tp-colswv_sw{background-color:var(--in-bg);border-radius:var(--bld-br);box-sizing:border-box;color:var(--in-fg);font-family:inherit;height:var(--cnt-usz);line-height:var(--cnt-usz);min-width:0;width:100%}.tp-txtv_i:hover,.tp-p2dpv_p:hover,.tp-colswv_sw:hover{background-color:var(--in-bg-h)}.tp-txtv_i:focus,.tp-p2dpv_p:focus,.tp-colswv_sw:focus{background-color:var(--in-bg-f)}.tp-txtv_i:active,.tp-p2dpv_p:active,.tp-colswv_sw:active{background-color:var(--in-bg-a)}.tp-txtv_i:disabled,.tp-p2dpv_p:disabled,.tp-colswv_sw:disabled{opacity:.5}.tp-lstv,.tp-coltxtv_m{position:relative}.tp-lstv_s{padding:0 20px 0 4px;width:100%}.tp-lstv_m,.tp-coltxtv_mm{bottom:0;margin:auto;pointer-events:none;position:absolute;right:2px;top:0}.tp-lstv_m svg,.tp-coltxtv_mm svg{bottom:0;height:16px;margin:auto;position:absolute;right:0;top:0;width:16px}.tp-lstv_m svg path,.tp-coltxtv_mm svg path{fill:currentColor}.tp-sglv_i,.tp-mllv_i,.tp-grlv_g{background-color:var(--mo-bg);border-radius:var(--bld-br);box-sizing:border-box;color:var(--mo-fg);height:var(--cnt-usz);scrollbar-color:currentColor rgba(0,0,0,0);scrollbar-width:thin;width:100%}.tp-sglv_i::-webkit-scrollbar,.tp-mllv_i::-webkit-scrollbar,.tp-grlv_g::-webkit-scrollbar{height:8px;width:8px}.tp-sglv_i::-webkit-scrollbar-corner,.tp-mllv_i::-webkit-scrollbar-corner,.tp-grlv_g::-webkit-scrollbar-corner{background-color:rgba(0,0,0,0)}.tp-sglv_i::-webkit-scrollbar-thumb,.tp-mllv_i::-webkit-scrollbar-thumb,.tp-grlv_g::-webkit-scrollbar-thumb{background-clip:padding-box;background-color:currentColor;border:rgba(0,0,0,0) solid 2px;border-radius:4px}.tp-pndtxtv,.tp-coltxtv_w{display:flex}.tp-pndtxtv_a,.tp-coltxtv_c{width:100%}.tp-pndtxtv_a+.tp-pndtxtv_a,.tp-coltxtv_c+.tp-pndtxtv_a,.tp-pndtxtv_a+.tp-coltxtv_c,.tp-coltxtv_c+.tp-coltxtv_c{margin-left:2px}.tp-rotv{--bs-bg: var(--tp-base-background-color, hsl(230, 7%, 17%));--bs-br: var(--tp-base-border-radius, 6px);--bs-ff: var(--tp-base-font-family, Roboto Mono, Source Code Pro, Menlo, Courier, monospace);--bs-sh: var(--tp-base-shadow-color, rgba(0, 0, 0, 0.2));--bld-br: var(--tp-blade-border-radius, 2px);--bld-hp: var(--tp-blade-horizontal-padding, 4px);--bld-vw: var(--tp-blade-value-width, 160px);--btn-bg: var(--tp-button-background-color, hsl(230, 7%, 70%));--btn-bg-a: var(--tp-button-background-color-active, #d6d7db);--btn-bg-f: var(--tp-button-background-color-focus, #c8cad0);--btn-bg-h: var(--tp-button-background-color-hover, #bbbcc4);--btn-fg: var(--tp-button-foreground-color, hsl(230, 7%, 17%));--cnt-bg: var(--tp-container-background-color, rgba(187, 188, 196, 0.1));--cnt-bg-a: var(--tp-container-background-color-active, rgba(187, 188, 196, 0.25));--cnt-bg-f: var(--tp-container-background-color-focus, rgba(187, 188, 196, 0.2));--cnt-bg-h: var(--tp-container-background-color-hover, rgba(187, 188, 196, 0.15));--cnt-fg: var(--tp-container-foreground-color, hsl(230, 7%, 75%));--cnt-hp: var(--tp-container-horizontal-padding, 4px);--cnt-vp: var(--tp-container-vertical-padding, 4px);--cnt-usp: var(--tp-container-unit-spacing, 4px);--cnt-usz: var(--tp-container-unit-size, 20px);--in-bg: var(--tp-input-background-color, rgba(187, 188, 196, 0.1));--in-bg-a: var(--tp-input-background-color-active, rgba(187, 188, 196, 0.25));--in-bg-f: var(--tp-input-background-color-focus, rgba(187, 188, 196, 0.2));--in-bg-h: var(--tp-input-background-color-hover, rgba(187, 188, 196, 0.15));--in-fg: var(--tp-input-foreground-color, hsl(230, 7%, 75%));--lbl-fg: var(--tp-label-foreground-color, rgba(187, 188, 196, 0.7));--mo-bg: var(--tp-monitor-background-color, rgba(0, 0, 0, 0.2));--mo-fg: var(--tp-monitor-foreground-color, rgba(187, 188, 196, 0.7));--grv-fg: var(--tp-groove-foreground-color, rgba(187, 188, 196, 0.1))}.tp-btnv_b{width:100%}.tp-btnv_t{text-align:center}.tp-ckbv_l{display:block;position:relative}.tp-ckbv_i{left:0;opacity:0;position:absolute;top:0}.tp-ckbv_w{background-color:var(--in-bg);border-radius:var(--bld-br);cursor:pointer;display:block;height:var(--cnt-usz);position:relative;width:var(--cnt-usz)}.tp-ckbv_w svg{display:block;height:16px;inset:0;margin:auto;opacity:0;position:absolute;width:16px}.tp-ckbv_w svg path{fill:none;stroke:var(--in-fg);stroke-width:2}.tp-ckbv_i:hover+.tp-ckbv_w{background-color:var(--in-bg-h)}.tp-ckbv_i:focus+.tp-ckbv_w{background-color:var(--in-bg-f)}.tp-ckbv_i:active+.tp-ckbv_w{background-color:var(--in-bg-a)}.tp-ckbv_i:checked+.tp-ckbv_w svg{opacity:1}.tp-ckbv.tp-v-disabled .tp-ckbv_w{opacity:.5}.tp-colv{position:relative}.tp-colv_h{display:flex}.tp-colv_s{flex-grow:0;flex-shrink:0;width:var(--cnt-usz)}.tp-colv_t{flex:1;margin-left:4px}.tp-colv_p{height:0;margin-top:0;opacity:0;overflow:hidden;transition:height .2s ease-in-out,opacity .2s linear,margin .2s ease-in-out}.tp-colv.tp-colv-expanded.tp-colv-cpl .tp-colv_p{overflow:visible}.tp-colv.tp-colv-expanded .tp-colv_p{margin-top:var(--cnt-usp);opacity:1}.tp-colv .tp-popv{left:calc(-1*var(--cnt-hp));right:calc(-1*var(--cnt-hp));top:var(--cnt-usz)}.tp-colpv_h,.tp-colpv_ap{margin-left:6px;margin-right:6px}.tp-colpv_h{margin-top:var(--cnt-usp)}.tp-colpv_rgb{display:flex;margin-top:var(--cnt-usp);width:100%}.tp-colpv_a{display:flex;margin-top:var(--cnt-vp);padding-top:calc(var(--cnt-vp) + 2px);position:relative}.tp-colpv_a::before{background-color:var(--grv-fg);content:"";height:2px;left:calc(-1*var(--cnt-hp));position:absolute;right:calc(-1*var(--cnt-hp));top:0}.tp-colpv.tp-v-disabled .tp-colpv_a::before{opacity:.5}.tp-colpv_ap{align-items:center;display:flex;flex:3}.tp-colpv_at{flex:1;margin-left:4px}.tp-svpv{border-radius:var(--bld-br);outline:none;overflow:hidden;position:relative}.tp-svpv.tp-v-disabled{opacity:.5}.tp-svpv_c{cursor:crosshair;display:block;height:calc(var(--cnt-usz)*4);width:100%}.tp-svpv_m{border-radius:100%;border:rgba(255,255,255,.75) solid 2px;box-sizing:border-box;filter:drop-shadow(0 0 1px rgba(0, 0, 0, 0.3));height:12px;margin-left:-6px;margin-top:-6px;pointer-events:none;position:absolute;width:12px}.tp-svpv:focus .tp-svpv_m{border-color:#fff}.tp-hplv{cursor:pointer;height:var(--cnt-usz);outline:none;position:relative}.tp-hplv.tp-v-disabled{opacity:.5}.tp-hplv_c{background-image:url(data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAEAAAAABCAYAAABubagXAAAAQ0lEQVQoU2P8z8Dwn0GCgQEDi2OK/RBgYHjBgIpfovFh8j8YBIgzFGQxuqEgPhaDOT5gOhPkdCxOZeBg+IDFZZiGAgCaSSMYtcRHLgAAAABJRU5ErkJggg==);background-position:left top;background-repeat:no-repeat;background-size:100% 100%;border-radius:2px;display:block;height:4px;left:0;margin-top:-2px;position:absolute;top:50%;width:100%}.tp-hplv_m{border-radius:var(--bld-br);border:rgba(255,255,255,.75) solid 2px;box-shadow:0 0 2px rgba(0,0,0,.1);box-sizing:border-box;height:12px;left:50%;margin-left:-6px;margin-top:-6px;position:absolute;top:50%;width:12px}.tp-hplv:focus .tp-hplv_m{border-color:#fff}.tp-aplv{cursor:pointer;height:var(--cnt-usz);outline:none;position:relative;width:100%}.tp-aplv.tp-v-disabled{opacity:.5}.tp-aplv_b{background-color:#fff;background-image:linear-gradient(to top right, #ddd 25%, transparent 25%, transparent 75%, #ddd 75%),linear-gradient(to top right, #ddd 25%, transparent 25%, transparent 75%, #ddd 75%);background-size:4px 4px;background-position:0 0,2px 2px;border-radius:2px;display:block;height:4px;left:0;margin-top:-2px;overflow:hidden;position:absolute;top:50%;width:100%}.tp-aplv_c{inset:0;position:absolute}.tp-aplv_m{background-color:#fff;background-image:linear-gradient(to top right, #ddd 25%, transparent 25%, transparent 75%, #ddd 75%),linear-gradient(to top right, #ddd 25%, transparent 25%, transparent 75%, #ddd 75%);background-size:12px 12px;background-position:0 0,6px 6px;border-radius:var(--bld-br);box-shadow:0 0 2px rgba(0,0,0,.1);height:12px;left:50%;margin-left:-6px;margin-top:-6px;overflow:hidden;position:absolute;top:50%;width:12px}.tp-aplv_p{border-radius:var(--bld-br);border:rgba(255,255,255,.75) solid 2px;box-sizing:border-box;inset:0;position:absolute}.tp-aplv:focus .tp-aplv_p{border-color:#fff}.tp-colswv{background-color:#fff;background-image:linear-gradient(to top right, #ddd 25%, transparent 25%, transparent 75%, #ddd 75%),linear-gradient(to top right, #ddd 25%, transparent 25%, transparent 75%, #ddd 75%);background-size:10px 10px;background-position:0 0,5px 5px;border-radius:var(--bld-br);overflow:hidden}.tp-colswv.tp-v-disabled{opacity:.5}.tp-colswv_sw{border-radius:0}.tp-colswv_b{cursor:pointer;display:block;height:var(--cnt-usz);left:0;position:absolute;top:0;width:var(--cnt-usz)}.tp-colswv_b:focus::after{border:rgba(255,255,255,.75) solid 2px;border-radius:var(--bld-br);content:"";display:block;inset:0;position:absolute}.tp-coltxtv{display:flex;width:100%}.tp-coltxtv_m{margin-right:4px}.tp-coltxtv_ms{border-radius:var(--bld-br);color:var(--lbl-fg);cursor:pointer;height:var(--cnt-usz);line-height:var(--cnt-usz);padding:0 18px 0 4px}.tp-coltxtv_ms:hover{background-color:var(--in-bg-h)}.tp-coltxtv_ms:focus{background-color:var(--in-bg-f)}.tp-coltxtv_ms:active{background-color:var(--in-bg-a)}.tp-coltxtv_mm{color:var(--lbl-fg)}.tp-coltxtv.tp-v-disabled .tp-coltxtv_mm{opacity:.5}.tp-coltxtv_w{flex:1}.tp-dfwv{position:absolute;top:8px;right:8px;width:256px}.tp-fldv{position:relative}.tp-fldv_t{padding-left:4px}.tp-fldv_b:disabled .tp-fldv_m{display:none}.tp-fldv_c{padding-left:4px}.tp-fldv_i{bottom:0;color:var(--cnt-bg);left:0;overflow:hidden;position:absolute;top:calc(var(--cnt-usz) + 4px);width:max(var(--bs-br),4px)}.tp-fldv_i::before{background-color:currentColor;bottom:0;content:"";left:0;position:absolute;top:0;width:4px}.tp-fldv_b:hover+.tp-fldv_i{color:var(--cnt-bg-h)}.tp-fldv_b:focus+.tp-fldv_i{color:var(--cnt-bg-f)}.tp-fldv_b:active+.tp-fldv_i{color:var(--cnt-bg-a)}.tp-fldv.tp-v-disabled>.tp-fldv_i{opacity:.5}.tp-grlv{position:relative}.tp-grlv_g{display:block;height:calc(var(--cnt-usz)*3)}.tp-grlv_g polyline{fill:none;stroke:var(--mo-fg);stroke-linejoin:round}.tp-grlv_t{margin-top:-4px;transition:left .05s,top .05s;visibility:hidden}.tp-grlv_t.tp-grlv_t-a{visibility:visible}.tp-grlv_t.tp-grlv_t-in{transition:none}.tp-grlv.tp-v-disabled .tp-grlv_g{opacity:.5}.tp-grlv .tp-ttv{background-color:var(--mo-fg)}.tp-grlv .tp-ttv::before{border-top-color:var(--mo-fg)}.tp-lblv{align-items:center;display:flex;line-height:1.3;padding-left:var(--cnt-hp);padding-right:var(--cnt-hp)}.tp-lblv.tp-lblv-nol{display:block}.tp-lblv_l{color:var(--lbl-fg);flex:1;-webkit-hyphens:auto;hyphens:auto;overflow:hidden;padding-left:4px;padding-right:16px}.tp-lblv.tp-v-disabled .tp-lblv_l{opacity:.5}.tp-lblv.tp-lblv-nol .tp-lblv_l{display:none}.tp-lblv_v{align-self:flex-start;flex-grow:0;flex-shrink:0;width:var(--bld-vw)}.tp-lblv.tp-lblv-nol .tp-lblv_v{width:100%}.tp-lstv_s{padding:0 20px 0 var(--bld-hp);width:100%}.tp-lstv_m{color:var(--btn-fg)}.tp-sglv_i{padding-left:var(--bld-hp);padding-right:var(--bld-hp)}.tp-sglv.tp-v-disabled .tp-sglv_i{opacity:.5}.tp-mllv_i{display:block;height:calc(var(--cnt-usz)*3);line-height:var(--cnt-usz);padding-left:var(--bld-hp);padding-right:var(--bld-hp);resize:none;white-space:pre}.tp-mllv.tp-v-disabled .tp-mllv_i{opacity:.5}.tp-p2dv{position:relative}.tp-p2dv_h{display:flex}.tp-p2dv_b{height:var(--cnt-usz);margin-right:4px;position:relative;width:var(--cnt-usz)}.tp-p2dv_b svg{display:block;height:16px;left:50%;margin-left:-8px;margin-top:-8px;position:absolute;top:50%;width:16px}.tp-p2dv_b svg path{stroke:currentColor;stroke-width:2}.tp-p2dv_b svg circle{fill:currentColor}.tp-p2dv_t{flex:1}.tp-p2dv_p{height:0;margin-top:0;opacity:0;overflow:hidden;transition:height .2s ease-in-out,opacity .2s linear,margin .2s ease-in-out}.tp-p2dv.tp-p2dv-expanded .tp-p2dv_p{margin-top:var(--cnt-usp);opacity:1}.tp-p2dv .tp-popv{left:calc(-1*var(--cnt-hp));right:calc(-1*var(--cnt-hp));top:var(--cnt-usz)}.tp-p2dpv{padding-left:calc(var(--cnt-usz) + 4px)}.tp-p2dpv_p{cursor:crosshair;height:0;overflow:hidden;padding-bottom:100%;position:relative}.tp-p2dpv.tp-v-disabled .tp-p2dpv_p{opacity:.5}.tp-p2dpv_g{display:block;height:100%;left:0;pointer-events:none;position:absolute;top:0;width:100%}.tp-p2dpv_ax{opacity:.1;stroke:var(--in-fg);stroke-dasharray:1}.tp-p2dpv_l{opacity:.5;stroke:var(--in-fg);stroke-dasharray:1}.tp-p2dpv_m{border:var(--in-fg) solid 1px;border-radius:50%;box-sizing:border-box;height:4px;margin-left:-2px;margin-top:-2px;position:absolute;width:4px}.tp-p2dpv_p:focus .tp-p2dpv_m{background-color:var(--in-fg);border-width:0}.tp-popv{background-color:var(--bs-bg);border-radius:var(--bs-br);box-shadow:0 2px 4px var(--bs-sh);display:none;max-width:var(--bld-vw);padding:var(--cnt-vp) var(--cnt-hp);position:absolute;visibility:hidden;z-index:1000}.tp-popv.tp-popv-v{display:block;visibility:visible}.tp-sldv.tp-v-disabled{opacity:.5}.tp-sldv_t{box-sizing:border-box;cursor:pointer;height:var(--cnt-usz);margin:0 6px;outline:none;position:relative}.tp-sldv_t::before{background-color:var(--in-bg);border-radius:1px;content:"";display:block;height:2px;inset:0;margin:auto;position:absolute}.tp-sldv_k{height:100%;left:0;position:absolute;top:0}.tp-sldv_k::before{background-color:var(--in-fg);border-radius:1px;content:"";display:block;height:2px;inset:0;margin-bottom:auto;margin-top:auto;position:absolute}.tp-sldv_k::after{background-color:var(--btn-bg);border-radius:var(--bld-br);bottom:0;content:"";display:block;height:12px;margin-bottom:auto;margin-top:auto;position:absolute;right:-6px;top:0;width:12px}.tp-sldv_t:hover .tp-sldv_k::after{background-color:var(--btn-bg-h)}.tp-sldv_t:focus .tp-sldv_k::after{background-color:var(--btn-bg-f)}.tp-sldv_t:active .tp-sldv_k::after{background-color:var(--btn-bg-a)}.tp-sldtxtv{display:flex}.tp-sldtxtv_s{flex:2}.tp-sldtxtv_t{flex:1;margin-left:4px}.tp-tabv{position:relative}.tp-tabv_t{align-items:flex-end;color:var(--cnt-bg);display:flex;overflow:hidden;position:relative}.tp-tabv_t:hover{color:var(--cnt-bg-h)}.tp-tabv_t:has(*:focus){color:var(--cnt-bg-f)}.tp-tabv_t:has(*:active){color:var(--cnt-bg-a)}.tp-tabv_t::before{background-color:currentColor;bottom:0;content:"";height:2px;left:0;pointer-events:none;position:absolute;right:0}.tp-tabv.tp-v-disabled .tp-tabv_t::before{opacity:.5}.tp-tabv.tp-tabv-nop .tp-tabv_t{height:calc(var(--cnt-usz) + 4px);position:relative}.tp-tabv.tp-tabv-nop .tp-tabv_t::before{background-color:var(--cnt-bg);bottom:0;content:"";height:2px;left:0;position:absolute;right:0}.tp-tabv_i{bottom:0;color:var(--cnt-bg);left:0;overflow:hidden;position:absolute;top:calc(var(--cnt-usz) + 4px);width:max(var(--bs-br),4px)}.tp-tabv_i::before{background-color:currentColor;bottom:0;content:"";left:0;position:absolute;top:0;width:4px}.tp-tabv_t:hover+.tp-tabv_i{color:var(--cnt-bg-h)}.tp-tabv_t:has(*:focus)+.tp-tabv_i{color:var(--cnt-bg-f)}.tp-tabv_t:has(*:active)+.tp-tabv_i{color:var(--cnt-bg-a)}.tp-tabv.tp-v-disabled>.tp-tabv_i{opacity:.5}.tp-tbiv{flex:1;min-width:0;position:relative}.tp-tbiv+.tp-tbiv{margin-left:2px}.tp-tbiv+.tp-tbiv.tp-v-disabled::before{opacity:.5}.tp-tbiv_b{display:block;padding-left:calc(var(--cnt-hp) + 4px);padding-right:calc(var(--cnt-hp) + 4px);position:relative;width:100%}.tp-tbiv_b:disabled{opacity:.5}.tp-tbiv_b::before{background-color:var(--cnt-bg);content:"";inset:0 0 2px;pointer-events:none;position:absolute}.tp-tbiv_b:hover::before{background-color:var(--cnt-bg-h)}.tp-tbiv_b:focus::before{background-color:var(--cnt-bg-f)}.tp-tbiv_b:active::before{background-color:var(--cnt-bg-a)}.tp-tbiv_t{color:var(--cnt-fg);height:calc(var(--cnt-usz) + 4px);line-height:calc(var(--cnt-usz) + 4px);opacity:.5;overflow:hidden;position:relative;text-overflow:ellipsis}.tp-tbiv.tp-tbiv-sel .tp-tbiv_t{opacity:1}.tp-tbpv_c{padding-bottom:var(--cnt-vp);padding-left:4px;padding-top:var(--cnt-vp)}.tp-txtv{position:relative}.tp-txtv_i{padding-left:var(--bld-hp);padding-right:var(--bld-hp)}.tp-txtv.tp-txtv-fst .tp-txtv_i{border-bottom-right-radius:0;border-top-right-radius:0}.tp-txtv.tp-txtv-mid .tp-txtv_i{border-radius:0}.tp-txtv.tp-txtv-lst .tp-txtv_i{border-bottom-left-radius:0;border-top-left-radius:0}.tp-txtv.tp-txtv-num .tp-txtv_i{text-align:right}.tp-txtv.tp-txtv-drg .tp-txtv_i{opacity:.3}.tp-txtv_k{cursor:pointer;height:100%;left:calc(var(--bld-hp) - 5px);position:absolute;top:0;width:12px}.tp-txtv_k::before{background-color:var(--in-fg);border-radius:1px;bottom:0;content:"";height:calc(var(--cnt-usz) - 4px);left:50%;margin-bottom:auto;margin-left:-1px;margin-top:auto;opacity:.1;position:absolute;top:0;transition:border-radius .1s,height .1s,transform .1s,width .1s;width:2px}.tp-txtv_k:hover::before,.tp-txtv.tp-txtv-drg .tp-txtv_k::before{opacity:1}.tp-txtv.tp-txtv-drg .tp-txtv_k::before{border-radius:50%;height:4px;transform:translateX(-1px);width:4px}.tp-txtv_g{bottom:0;display:block;height:8px;left:50%;margin:auto;overflow:visible;pointer-events:none;position:absolute;top:0;visibility:hidden;width:100%}.tp-txtv.tp-txtv-drg .tp-txtv_g{visibility:visible}.tp-txtv_gb{fill:none;stroke:var(--in-fg);stroke-dasharray:1}.tp-txtv_gh{fill:none;stroke:var(--in-fg)}.tp-txtv .tp-ttv{margin-left:6px;visibility:hidden}.tp-txtv.tp-txtv-drg .tp-ttv{visibility:visible}.tp-ttv{background-color:var(--in-fg);border-radius:var(--bld-br);color:var(--bs-bg);padding:2px 4px;pointer-events:none;position:absolute;transform:translate(-50%, -100%)}.tp-ttv::before{border-color:var(--in-fg) rgba(0,0,0,0) rgba(0,0,0,0) rgba(0,0,0,0);border-style:solid;border-width:2px;box-sizing:border-box;content:"";font-size:.9em;height:4px;left:50%;margin-left:-2px;position:absolute;top:100%;width:4px}.tp-rotv{background-color:var(--bs-bg);border-radius:var(--bs-br);box-shadow:0 2px 4px var(--bs-sh);font-family:var(--bs-ff);font-size:11px;font-weight:500;line-height:1;text-align:left}.tp-rotv_b{border-bottom-left-radius:var(--bs-br);border-bottom-right-radius:var(--bs-br);border-top-left-radius:var(--bs-br);border-top-right-radius:var(--bs-br);padding-left:calc(4px + var(--cnt-usz) + var(--cnt-hp));text-align:center}.tp-rotv.tp-rotv-expanded .tp-rotv_b{border-bottom-left-radius:0;border-bottom-right-radius:0;transition-delay:0s;transition-duration:0s}.tp-rotv.tp-rotv-not>.tp-rotv_b{display:none}.tp-rotv_b:disabled .tp-rotv_m{display:none}.tp-rotv_c>.tp-fldv.tp-v-lst>.tp-fldv_c{border-bottom-left-radius:var(--bs-br);border-bottom-right-radius:var(--bs-br)}.tp-rotv_c>.tp-fldv.tp-v-lst>.tp-fldv_i{border-bottom-left-radius:var(--bs-br)}.tp-rotv_c>.tp-fldv.tp-v-lst:not(.tp-fldv-expanded)>.tp-fldv_b{border-bottom-left-radius:var(--bs-br);border-bottom-right-radius:var(--bs-br)}.tp-rotv_c>.tp-fldv.tp-v-lst.tp-fldv-expanded>.tp-fldv_b{transition-delay:0s;transition-duration:0s}.tp-rotv_c .tp-fldv.tp-v-vlst:not(.tp-fldv-expanded)>.tp-fldv_b{border-bottom-right-radius:var(--bs-br)}.tp-rotv.tp-rotv-not .tp-rotv_c>.tp-fldv.tp-v-fst{margin-top:calc(-1*var(--cnt-vp))}.tp-rotv.tp-rotv-not .tp-rotv_c>.tp-fldv.tp-v-fst>.tp-fldv_b{border-top-left-radius:var(--bs-br);border-top-right-radius:var(--bs-br)}.tp-rotv_c>.tp-tabv.tp-v-lst>.tp-tabv_c{border-bottom-left-radius:var(--bs-br);border-bottom-right-radius:var(--bs-br)}.tp-rotv_c>.tp-tabv.tp-v-lst>.tp-tabv_i{border-bottom-left-radius:var(--bs-br)}.tp-rotv.tp-rotv-not .tp-rotv_c>.tp-tabv.tp-v-fst{margin-top:calc(-1*var(--cnt-vp))}.tp-rotv.tp-rotv-not .tp-rotv_c>.tp-tabv.tp-v-fst>.tp-tabv_t{border-top-left-radius:var(--bs-br);border-top-right-radius:var(--bs-br)}.tp-rotv.tp-v-disabled,.tp-rotv .tp-v-disabled{pointer-events:none}.tp-rotv.tp-v-hidden,.tp-rotv .tp-v-hidden{display:none}.tp-sprv_r{background-color:var(--grv-fg);border-width:0;display:block;height:2px;margin:0;width:100%}.tp-sprv.tp-v-disabled .tp-sprv_r{opacity:.5}',plugins:[C3,D3,I3,Tg,N3]})}}new Sg("4.0.5");const Fl={exposure:0,temperature:0,tint:0,saturation:1,hue_deg:0,opacity:1},F3=[["exposure","Exposure",-4,4,.05],["temperature","Temperature",-2,2,.05],["tint","Tint",-2,2,.05],["saturation","Saturation",0,3,.05],["hue_deg","Hue °",-180,180,1],["opacity","Opacity",0,4,.05]];function k3(n,t){const e={...Fl},i=n.addFolder({title:"Color",expanded:!1});let s=!1;const r=F3.map(([a,l,c,h,d])=>i.addBinding(e,a,{label:l,min:c,max:h,step:d}).on("change",({last:u})=>{u&&!s&&t({...e})})),o=i.addButton({title:"Own colors"}).on("click",()=>t({...Fl}));return{show(a){s=!0,Object.assign(e,Fl,a.grade),i.hidden=a.kind==="delete"||a.cage==="points";for(const l of r)l.disabled=a.locked,l.refresh();o.disabled=a.locked,s=!1}}}function B3(n,t){const e=n.addFolder({title:"Mirror the content",expanded:!1}),i=["x","y","z"].map(s=>e.addButton({title:`Along ${s} of the cage`}).on("click",()=>t({kind:"mirror",axis:s})));return{show(s){e.hidden=s.kind==="continuous"||s.kind==="delete";for(const r of i)r.disabled=s.locked}}}function z3(n,t){const e={parent:0};let i="",s=null;return{show(r,o){e.parent=r.parent??0;const a=Object.fromEntries([["None",0],...V3(r,o)]),l=JSON.stringify([r.id,a]);if(l!==i||s===null){s?.dispose(),i=l;const c=n.addBinding(e,"parent",{label:"Parent",options:a});c.element.title="The edit that carries this one: a finger follows its arm.",c.on("change",({value:h})=>t(h)),s=c}s.disabled=r.locked,s.refresh()}}}function V3(n,t){const e=new Map(t.map(r=>[r.id,r])),i=r=>{for(let o=r;o!==void 0;o=o.parent===null?void 0:e.get(o.parent))if(o.id===n.id)return!0;return!1};return t.filter(r=>r.name!==""&&r.source===null&&!i(r)).map(r=>[r.name,r.id])}const Op={Smooth:"smooth",Sphere:"sphere",Root:"root",Sharp:"sharp",Linear:"linear"},H3={"B-spline":"bspline",Linear:"linear"},G3={X:"x",Y:"y",Z:"z"},W3={Start:"start",Middle:"middle",End:"end"},X3=7;function q3(n,t,e){const i={cells:{x:1,y:1,z:4},interpolation:"bspline",curve:"smooth",radius:.1,falloff:"smooth",connected:!1,axis:"z",fixed:"start",degrees:30,factor:.5};let s=null;const r=d=>{const u=xe(n.store.now);if(u===null)return;const p=n.store.now.mode==="edit"?"field":"inner";n.send({type:"apply",edit:u.id,target:p,operation:d})},o=()=>({axis:i.axis,fixed:i.fixed}),a=e.addFolder({title:"Lattice",expanded:!1}),l={min:1,max:X3,step:1};a.addBinding(i,"cells",{label:"Cells",x:l,y:l,z:l}),a.addBinding(i,"interpolation",{label:"Interpolation",options:H3}),a.addButton({title:"Subdivide"}).on("click",()=>{const{x:d,y:u,z:p}=i.cells;t.subdivide([d,u,p],i.interpolation)}),a.addBinding(i,"curve",{label:"Proportional",options:Op}).on("change",({value:d})=>n.store.set({curve:d}));const c=e.addFolder({title:"Bend, twist, taper",expanded:!1});c.addBinding(i,"axis",{label:"Axis",options:G3}),c.addBinding(i,"fixed",{label:"Fixed end",options:W3}),c.addBinding(i,"degrees",{label:"Angle °",min:-720,max:720}),c.addButton({title:"Bend"}).on("click",()=>r({kind:"bend",...o(),degrees:i.degrees})),c.addButton({title:"Twist"}).on("click",()=>r({kind:"twist",...o(),degrees:i.degrees})),c.addBinding(i,"factor",{label:"Factor",min:.01,max:100}),c.addButton({title:"Taper"}).on("click",()=>r({kind:"taper",...o(),factor:i.factor}));const h=e.addFolder({title:"Control points"});return h.addBinding(i,"radius",{label:"Radius",min:1e-6}).on("change",({value:d,last:u})=>{const p=s?.points?.radius??null;u&&s!==null&&p!==null&&Math.abs(d-p)>1e-9&&n.send({type:"point_reach",edit:s.id,radius:d})}),h.addBinding(i,"falloff",{label:"Falloff",options:Op}).on("change",({value:d})=>{s?.points?.falloff&&d!==s.points.falloff&&n.send({type:"point_reach",edit:s.id,falloff:d})}),h.addBinding(i,"connected",{label:"Connected only"}).on("change",({value:d})=>{s?.points&&d!==s.points.connected&&n.send({type:"point_reach",edit:s.id,connected:d})}),{show(d){s=d;const{points:u}=d;a.hidden=d.kind!=="continuous"||d.cage==="points"||d.cage==="mesh",c.hidden=d.cage!=="lattice"&&d.cage!=="mesh",h.hidden=d.cage!=="points",i.curve=n.store.now.curve,u?.radius!=null&&u.falloff!==null&&Object.assign(i,{radius:u.radius,falloff:u.falloff,connected:u.connected})}}}const $3={Continuous:"continuous",Move:"move",Copy:"copy",Delete:"delete"},Y3={Flow:"flow",Trilinear:"trilinear"},K3={Smooth:"smooth",Linear:"linear"},Z3={"Contact shadows":"occlusion","Cast shadows too":"shadow",None:"none"},j3={Exact:0,"32³":32,"64³":64,"128³":128,"256³":256};function Q3(n,t){const e=G("div",{class:"pane"}),i=G("ol",{class:"operations"}),s=new r0({container:e}),r={kind:"continuous",from:"",shell:"flow",falloff:"smooth",width:1,lattice:0,error:"",fills:!0,relight:"occlusion",margin:.2,preserve:!1,position:As(0,0,0),turn:As(0,0,0),scale:As(1,1,1)};let o=!1;const a=D=>{const F=xe(n.store.now);!o&&F!==null&&n.send({type:"change",edit:F.id,...D})},l=D=>{const F=xe(n.store.now);F!==null&&n.send({type:"apply",edit:F.id,target:ui(n.store.now),operation:D})},c=D=>{setTimeout(()=>{o=!0,D(),s.refresh(),o=!1})},h=s.addFolder({title:"Numbers"});h.addBinding(r,"position",{label:"Position",format:qo}).on("change",({value:D,last:F})=>{const L=xe(n.store.now);if(o||!F||L===null)return;const{pivot:z}=Dn(n.shownCages(L),ui(n.store.now)),$=Cs(D).map((k,tt)=>Mn(k-z[tt]));Math.hypot(...$)>1e-9&&l(om(L.carrier,{kind:"translate",by:$}))}),h.addBinding(r,"turn",{label:"Turn by °",format:qo}).on("change",({value:D,last:F})=>{o||!F||Cs(D).every(L=>L===0)||(l({kind:"rotate",rotation_deg:Cs(D),axes:n.store.now.axes}),c(()=>r.turn=As(0,0,0)))}),h.addBinding(r,"scale",{label:"Scale by",format:qo}).on("change",({value:D,last:F})=>{o||!F||Cs(D).every(L=>L===1)||(Cs(D).every(L=>L>0)?l({kind:"scale",by:Cs(D),axes:n.store.now.axes}):n.say("scale factors must be above 0","warning"),c(()=>r.scale=As(1,1,1)))});const u=s.addFolder({title:"Kind"}),p=u.addBinding(r,"kind",{label:"Kind",options:$3});p.on("change",({value:D})=>a({kind:D}));const g=u.addBinding(r,"from",{label:"Pasted from",readonly:!0}),x=[u.addBinding(r,"shell",{label:"Shell",options:Y3}).on("change",({value:D})=>a({shell:D})),u.addBinding(r,"falloff",{label:"Falloff",options:K3}).on("change",({value:D})=>a({falloff:D})),u.addBinding(r,"width",{label:"Width",min:.05,max:1,step:.05}).on("change",({value:D,last:F})=>{F&&a({width:D})}),u.addBinding(r,"lattice",{label:"Map nodes",options:j3}).on("change",({value:D})=>a({lattice:D})),u.addBinding(r,"error",{label:"Its error",readonly:!0})],m=u.addBinding(r,"fills",{label:"Fill what is uncovered"});m.on("change",({value:D})=>a({fill:D?"surroundings":"none"})),Fp(m,"The ground or wall that the thing stood on goes on where it was; off, a hole stays (U).");const f=u.addBinding(r,"relight",{label:"Shadows go along",options:Z3});f.on("change",({value:D})=>a({relight:D})),Fp(f,"Soft shadows where things touch leave with the thing and appear at its new place, those of a dominant light too, where one is found, or all stay (Shift+U).");const _=z3(u,D=>a({parent:D}));u.addBinding(r,"preserve",{label:"Keep opacity"}).on("change",({value:D})=>{o||n.send({type:"scene_change",preserve_opacity:D})});const M=B3(s,l),b=k3(s,D=>a({grade:D})),E=s.addFolder({title:"Cages"});E.addButton({title:"Fit the inner cage (I)"}).on("click",()=>t.fitInner()),E.addBinding(r,"margin",{label:"Margin",min:.001,format:qo}),E.addButton({title:"Outer cage by margin"}).on("click",()=>t.outerMargin(r.margin));const T=s.addButton({title:"Align by pairs of points (Shift+A)"});T.on("click",()=>t.togglePicking("paste"));const v=q3(n,t,s),S=G("button",{type:"button",class:"text",onclick:()=>t.withSelected(D=>t.command("remove_last_operation",D.id))},"Take the last one back"),N=G("button",{type:"button",class:"text",onclick:()=>t.withSelected(D=>t.command("reset_operations",D.id))},"Reset"),P=cs("Selected edit",e,G("div",{class:"subtitle"},"Operations"),i,G("div",{class:"bar"},S,N));let U=null;return n.store.watch(["state","mode","cage"],D=>{const F=xe(D);if(P.hidden=F===null,F===null)return;const{pivot:L}=Dn(n.shownCages(F),ui(D));Object.assign(r,{kind:F.kind,from:F.source?.split(/[\\/]/).at(-1)??"",shell:F.shell,falloff:F.falloff,width:F.width,lattice:F.lattice,error:J3(F),fills:F.fill!=="none",relight:F.relight,preserve:D.state?.preserve_opacity??!1,position:As(...L)}),U!==F.id&&(U=F.id,r.margin=Mn(.5*Os(F.inner),3));const[z,$,k,tt,W]=x;for(const Q of x)Q.hidden=F.kind!=="continuous";$.hidden=k.hidden=F.kind!=="continuous"||F.shell!=="flow"||F.cage==="points",W.hidden=tt.hidden||F.lattice===0,p.hidden=F.source!==null,T.hidden=F.source===null,T.disabled=F.locked,g.hidden=F.source===null,f.hidden=!Zf(D),m.hidden=!jf(D);for(const Q of[z,tt,m,f])Q.disabled=F.locked;F.cage!=="box"&&(z.disabled=!0),o=!0,v.show(F),_.show(F,D.state?.edits??[]),b.show(F),M.show(F),s.refresh(),o=!1,i.replaceChildren(...F.operations.map(Q=>G("li",{},Q))),S.disabled=N.disabled=F.operations.length===0}),P}function Fp(n,t){n.element.title=t;const e=n.element.querySelector("input, select");e.setAttribute("aria-label",n.element.querySelector(".tp-lblv_l").textContent),e.setAttribute("aria-description",t)}function J3(n){if(n.lattice_error===null)return"being measured";const[t,e]=n.lattice_error;return t===0?"none":`≤ ${t.toPrecision(2)}, mean ${e.toPrecision(2)} voxels`}function As(n,t,e){return{x:n,y:t,z:e}}function Cs({x:n,y:t,z:e}){return[n,t,e]}function qo(n){return String(Mn(Number(n.toPrecision(4))))}const tL=7e3,eL=150,nL=400;function iL(n,t){const e=G("div",{class:"overlay"});return e.append(sL(n),rL(n,t),oL(n),aL(n),lL(n),cL(n)),e}function sL(n){const t=G("div",{class:"splitter"},G("span",{class:"before"},"before"),G("span",{class:"grip"}),G("span",{class:"after"},"after"));return t.onpointerdown=e=>t.setPointerCapture(e.pointerId),t.onpointermove=e=>{if(!t.hasPointerCapture(e.pointerId))return;const i=n.viewport.canvas.getBoundingClientRect();n.store.set({split:Math.min(.98,Math.max(.02,(e.clientX-i.left)/i.width))})},n.store.watch(["split"],({split:e})=>{t.hidden=e===null,t.style.left=`${100*(e??0)}%`}),t}function rL(n,t){const e=G("div",{class:"readout"});e.hidden=!0;let i=-1/0,s;const r=()=>{clearTimeout(s);const{drag:o}=n,a=o===null||o.ended?null:o.followed,l=performance.now()<i+eL;if(a!==null&&!e.hidden&&n.viewport.software&&l){s=setTimeout(r,nL);return}if(i=performance.now(),e.hidden=a===null,o===null||a===null)return;e.textContent=Xy(a),e.classList.toggle("limit",o.why!==null);const{width:c,height:h}=n.viewport.points,d=Math.min(t.position.x+18,c-e.offsetWidth-6),u=Math.min(t.position.y+18,h-e.offsetHeight-6);e.style.transform=`translate(${d}px, ${u}px)`};return n.viewport.beforeFrame.push(r),e}function oL(n){const t=G("div",{class:"toasts"});return n.store.watch(["notice"],({notice:e})=>{if(e===null||e.level==="info")return;const i=G("div",{class:`toast ${e.level}`,role:"alert",onclick:()=>i.remove()},e.text);for(t.append(i);t.children.length>3;)t.firstElementChild?.remove();setTimeout(()=>i.remove(),tL)}),t}function aL(n){const t=G("div",{class:"lost",role:"alert"},"The server is gone. Trying again…");return n.store.watch(["connection"],({connection:e})=>{t.hidden=e!=="lost"}),t}function lL(n){const t=G("span"),e=G("progress",{max:1}),i=G("div",{class:"opening",role:"status"},t,e);return n.store.watch(["upload"],({upload:s})=>{i.hidden=s===null,s!==null&&(t.textContent=s.share<1?`Sending ${s.name}`:`Opening ${s.name}`,s.share<1?e.value=s.share:e.removeAttribute("value"))}),i}function cL(n){const t=G("div",{class:"hint"},"Double-click the picture to put a pair of cages around what is there");return n.store.watch(["state","hello","measured","placesHotspot","picked"],e=>{const i=e.state===null||e.state.edits.length>0;t.hidden=Xe(e)||i||Nr(e)}),t}function hL(n,t,e){const i=G("ol",{class:"keys"}),s=G("span",{class:"quiet"}),r=(m,f=n.store.now.state?.loop??!1)=>{n.send({type:"set_path",keys:m,loop:f})},o=()=>n.store.now.state?.keys??[],a=(m,f)=>o().map((_,M)=>M===m?{..._,...f}:_),l=At(ap,"Play the path in this page, as its video will be",()=>n.player.toggle(),"play"),c=At(DA,"Back to the first keyframe: a loop",()=>r(o(),!n.store.now.state?.loop),"loop"),h=G("button",{type:"button",class:"text",onclick:()=>e.render("camera_path")},"Render video…"),d=G("button",{type:"button",class:"text",title:"Edited splats of each frame: a sequence of files, or USD with time samples",onclick:()=>e.download(!0)},"Download frames…"),u=Oc(Km,"Download the camera path, as nerfstudio has it",`camera_path.json${location.search}`,"camera_path.json"),p=G("button",{type:"button",class:"text",onclick:()=>e.render("test_views")},"Render test views…"),g=(m,f,_)=>{const M=G("input",{type:"number",min:"0.1",max:"3600",step:"0.5",value:String(m.seconds),title:"Seconds to the next keyframe"});M.onchange=()=>r(a(f,{seconds:Math.max(.1,Number(M.value)||2)}));const b=_.map(E=>{const T=m.parts[String(E.id)]??1,v=G("input",{type:"range",min:"0",max:"1",step:"0.05",value:String(T),title:`How far “${E.name}” has gone here`});return v.style.accentColor=E.color,v.onchange=()=>{v.blur(),r(a(f,{parts:{...m.parts,[E.id]:Number(v.value)}}))},G("label",{class:"part"},G("span",{},E.name||`edit ${E.id}`),v)});return G("li",{class:"key"},G("div",{class:"row"},G("span",{class:"number"},String(f+1)),M,G("span",{class:"quiet"},"s"),G("span",{class:"space"}),At(Ym,"Look from here",()=>uL(n,m.c2w,m.fov_y_deg),"go"),At(Qm,"Take the view as it is now",()=>r(a(f,{c2w:n.viewport.c2w})),"update"),At(Th,"Remove this keyframe",()=>r(o().filter((E,T)=>T!==f)),"drop")),...b)};let x=new Map;return n.store.watch(["state"],({state:m})=>{if(m===null||document.activeElement instanceof HTMLInputElement&&i.contains(document.activeElement)&&document.activeElement.type==="range")return;const f=m.edits.map(({id:E,name:T,color:v})=>[E,T,v]),_=x;x=new Map(m.keys.map((E,T)=>{const v=JSON.stringify([T,E,f]);return[v,_.get(v)??g(E,T,m.edits)]}));const M=[...x.values()];for(M.forEach((E,T)=>{i.children[T]!==E&&i.insertBefore(E,i.children[T]??null)});i.children.length>M.length;)i.lastElementChild?.remove();const b=Xm(m.keys,m.loop);s.textContent=m.keys.length===0?"no keyframes":`${b.toFixed(1)} s`,l.disabled=h.disabled=m.keys.length<2,d.disabled=m.keys.length===0,d.hidden=n.store.now.hello?.splats!==!0,u.hidden=m.keys.length===0,c.classList.toggle("on",m.loop)}),n.player.changed=m=>l.replaceChildren(Zr(m?tg:ap)),cs("Camera path",G("div",{class:"bar"},At(jm,"Keyframe from this view (K)",()=>t.addKey(),"add-key"),l,c,u,G("span",{class:"space"}),s),i,G("div",{class:"bar"},h,d,p))}function uL(n,t,e){const{hello:i}=n.store.now;if(i===null)return;const s=i.bounds[0].map((r,o)=>.5*(r+i.bounds[1][o]));n.viewport.lookFrom(t,e,La(n.store.now),s)}const dL=["opacity","size","hue","saturation","value","red","green","blue"],kp="http://www.w3.org/2000/svg",Mr=268,Aa=64;function pL(n){const t=G("select",{ariaLabel:"Attribute of the histogram"},...dL.map(f=>G("option",{value:f},f))),e=document.createElementNS(kp,"svg");e.setAttribute("viewBox",`0 0 ${Mr} ${Aa}`),e.setAttribute("preserveAspectRatio","none");const[i,s,r]=["all","chosen","between"].map(f=>{const _=document.createElementNS(kp,"path");return _.setAttribute("class",f),_});e.append(i,s,r);const o=G("span",{class:"quiet range"}),a=G("details",{class:"histogram"},G("summary",{},"By attribute"),G("div",{class:"row",title:"Drag over the bars to select a range"},t,o),e);let l=null,c=null,h,d=0;const u=()=>t.value,p=()=>{if(!a.open)return;h=n.store.now.state?.selection??null;const f=++d;n.ask({what:"histogram",attribute:u()}).then(_=>{f!==d||!_?.histogram||(l=_.histogram,g())})},g=()=>{i.setAttribute("d",l===null?"":zp(l.counts,l.counts)),s.setAttribute("d",l===null?"":zp(l.selected,l.counts));const[f,_]=c===null?[0,0]:[Math.min(...c),Math.max(...c)];r.setAttribute("d",`M${f*Mr} 0H${_*Mr}V${Aa}H${f*Mr}Z`),o.textContent=c===null||l===null?"":`${Bp(x(f))} to ${Bp(x(_))}`},x=f=>{const{low:_,high:M}=l;return u()==="size"?_*(M/_)**f:_+(M-_)*f},m=f=>{const _=e.getBoundingClientRect();return Math.min(1,Math.max(0,(f.clientX-_.left)/_.width))};return e.onpointerdown=f=>{l!==null&&(e.setPointerCapture(f.pointerId),c=[m(f),m(f)],g())},e.onpointermove=f=>{c!==null&&(c[1]=m(f),g())},e.onpointerup=()=>{if(c===null||l===null)return;const[f,_]=[Math.min(...c),Math.max(...c)].map(x);c=null;const M=n.store.now.selectMode;n.send({type:"select_range",attribute:u(),low:f,high:_,mode:M}),g()},t.onchange=p,a.ontoggle=p,n.store.watch(["hello"],({hello:f})=>{const _=t.querySelector("option[value=size]");_.disabled=f?.splats===!1,l=null,g(),p()}),n.store.watch(["state"],({state:f})=>{const _=f?.selection??null;JSON.stringify(_)!==JSON.stringify(h)&&p()}),a}function Bp(n){return Number(n.toPrecision(3)).toString()}function zp(n,t){const e=Math.log1p(Math.max(...t,1)),i=Mr/n.length;return n.map((s,r)=>{const o=Math.log1p(s)/e*(Aa-2);return`M${r*i} ${Aa}v${-o}h${i-1}v${o}Z`}).join("")}const fL={Replace:"replace",Add:"add",Subtract:"subtract",Intersect:"intersect"};function mL(n,t){const{store:e}=n,i=G("p",{class:"empty selected-count"}),s=G("div",{class:"pane"}),r=new r0({container:s}),o={mode:e.now.selectMode,radius:e.now.brushRadius,through:e.now.through,depth:e.now.depthTolerance,opacity:e.now.floodOpacity,reach:e.now.floodReach,strength:.5,margin:1};r.addBinding(o,"mode",{label:"Mode",options:fL}).on("change",({value:_})=>e.set({selectMode:_}));const a=r.addBinding(o,"radius",{label:"Brush size",min:.005,max:.5});a.on("change",({value:_})=>e.set({brushRadius:_})),r.addBinding(o,"through",{label:"Through all"}).on("change",({value:_})=>e.set({through:_}));const l=r.addBinding(o,"depth",{label:"Depth, cells",min:0,max:20,step:.5});l.on("change",({value:_})=>e.set({depthTolerance:_})),r.addBinding(o,"opacity",{label:"Flood from",min:.02,max:.98}).on("change",({value:_})=>e.set({floodOpacity:_})),r.addBinding(o,"reach",{label:"Flood reach",min:.01,max:1}).on("change",({value:_})=>e.set({floodReach:_})),r.addBinding(o,"strength",{label:"Floaters",min:0,max:1,step:.05}).on("change",({last:_})=>{_&&c()}),r.addBinding(o,"margin",{label:"Cells around",min:0,max:20,step:.5});function c(){n.send({type:"select_floaters",strength:o.strength})}const h=(_,M,b,E)=>G("button",{type:"button",class:`text ${b}`,title:M,onclick:E},_),d=[h("Invert","Select all others (Ctrl+I)","invert",()=>t.changeSelection("invert")),h("Grow","One cell more around (Ctrl and +)","grow",()=>t.changeSelection("grow")),h("Shrink","One cell less around (Ctrl and -)","shrink",()=>t.changeSelection("shrink"))],u=[["Cage around it","A new edit with a cage around the selection (E)","enclose","box"],["Lattice","A new edit with a lattice around the selection (Shift+E)","enclose-lattice","lattice"],["Mesh","A new edit with a closed mesh around the selection (Alt+E)","enclose-mesh","mesh"]].map(([_,M,b,E])=>h(_,M,b,()=>t.encloseSelection(E,o.margin))),p=h("Isolate","Show the selection alone, or all again (/)","isolate",()=>t.toggleIsolated()),g=h("Delete selected","Delete the selection (Ctrl+Delete)","delete-selected",()=>t.removeElements()),x=h("Restore deleted","Restore all that was deleted","restore-deleted",()=>t.restoreElements()),m=pL(n),f=cs("Selection",i,G("div",{class:"bar"},h("All","Select all (A)","all",()=>t.changeSelection("all")),h("None","Select none (Alt+A)","none",()=>t.changeSelection("none")),...d),s,G("div",{class:"bar"},h("Floaters","Select probable floaters","floaters",c),...u,p),G("div",{class:"bar"},g,x),m);return f.classList.add("selection"),f.open=!1,e.watch(["selecting"],({selecting:_})=>{_!==null&&(f.open=!0)}),e.watch(["brushRadius"],({brushRadius:_})=>{o.radius=_,a.refresh()}),e.watch(["through"],({through:_})=>{l.disabled=_}),e.watch(["state","hello"],({state:_,hello:M})=>{const b=_?.selection??null,E=M?.splats===!0?"splats":"cells";i.textContent=b===null?`No ${E} are selected: brush (M), lasso (J), or Shift+drag.`:`${b.count.toLocaleString("en")} of ${b.total.toLocaleString("en")} ${E} selected`;const T=_?.removed??null;x.hidden=T===null,x.textContent=`Restore ${T?.count.toLocaleString("en")??""} ${E}`,p.disabled=b===null&&_?.isolated!==!0,p.textContent=_?.isolated===!0?"Show all":"Isolate";for(const v of[...d,...u,g])v.disabled=b===null}),f}const gL=12e3,vL=2e3;function _L(n){const t=G("span",{class:"message"}),e=G("span",{class:"preparing",hidden:!0,role:"status"}),i=G("span",{class:"loading",hidden:!0,role:"status"}),s=G("progress",{max:1});i.append("Loading the field ",s),i.title="Once it is here, this page's own GPU draws",n.store.watch(["loading"],({loading:h})=>{i.hidden=h===null,s.value=h??0});const r=G("span",{class:"figures"}),o=G("span",{class:"saved"}),a=G("span",{class:"connection"});let l;n.store.watch(["limit","notice","mode","state"],h=>{const d=h.notice;t.className=`message ${h.limit!==null?"limit":d?.level??""}`,t.title=h.limit??d?.text??"",t.textContent=h.limit!==null?`The drag stops here: ${h.limit}`:t.title}),n.store.watch(["notice"],h=>{clearTimeout(l),h.notice?.level==="info"&&(l=setTimeout(()=>n.store.set({notice:null}),gL))});let c;return e.title="Kernels are compiled once for a machine; what edits uncover, and their shadows, are worked out when a scene is opened",n.store.watch(["preparing","figures","state"],h=>{const d=lS(h);e.textContent!==(d??"")&&(e.textContent=d),d===null?(clearTimeout(c),c=void 0,e.hidden=!0):c??=setTimeout(()=>e.hidden=!1,vL)}),n.store.watch(["figures","state","connection"],({figures:h,state:d,connection:u})=>{let p=h.perSecond>=.5&&!h.final?`${h.perSecond.toFixed(0)} pictures/s · `:"";h.whole&&!h.final&&(p="Refining · "),r.textContent=h.width>0?`${p}${h.width}×${h.height} · ${h.renderMs.toFixed(0)} ms · ${h.page?"drawn here":"by the server"}`:"",r.title=[n.page.why??"",n.page.location.summary].filter(g=>g!=="").join(" · "),o.textContent=d===null?"":d.saved?"saved":"not saved",o.classList.toggle("due",d?.saved===!1),a.className=`connection ${u}`,a.title={open:"Connected",connecting:"Connecting…",lost:"The server is gone"}[u]}),G("footer",{class:"status"},t,G("span",{class:"space"}),e,i,r,o,a)}const xL=[[MA,"brush","Select with a brush (M); [ and ] change its size"],[_A,"lasso","Select with a lasso (J)"],[zA,"rectangle","Select in a rectangle (Shift+drag)"],[EA,"flood","Select what is connected to a click"]];function bL(n,t){const e=G("nav",{class:"tools"}),i=[],s=[],r=[],o=(u,p)=>(i.push([u,p]),u),a=(...u)=>G("div",{class:"group"},...u),l=(...u)=>{const p=a(...u);return r.push(p),p},c=o(At(wA,"Snap; Ctrl does the opposite while held",()=>t.toggle("snap"),"snap"),u=>u.snap),h=o(At(PA,"Proportional editing of control points (O); the wheel changes its radius while dragging",()=>t.toggleProportional(!1),"proportional"),u=>u.proportional);r.push(c,h);const d=a(o(At(tg,"Move the inner cage (C)",()=>t.setCage("inner"),"cage-inner"),u=>u.cage==="inner"),o(At(VA,"Move the outer cage (C)",()=>t.setCage("outer"),"cage-outer"),u=>u.cage==="outer"),o(At(nA,"Move both cages (C)",()=>t.setCage("both"),"cage-both"),u=>u.cage==="both"));return s.push(d),e.append(l(o(At(yA,"Select: no gizmo (4, Q)",()=>t.setTool("select"),"tool-select"),u=>u.selecting===null&&u.tool==="select"),o(At(SA,"Move (1, G)",()=>t.setTool("translate"),"tool-translate"),u=>u.selecting===null&&u.tool==="translate"),o(At(IA,"Rotate (2, R)",()=>t.setTool("rotate"),"tool-rotate"),u=>u.selecting===null&&u.tool==="rotate"),o(At(FA,"Scale (3, S)",()=>t.setTool("scale"),"tool-scale"),u=>u.selecting===null&&u.tool==="scale")),l(o(At(AA,"Set mode: move cages, never the field (Tab)",()=>t.setMode("set"),"mode-set"),u=>u.mode==="set"),o(At(kA,"Edit mode: the field follows the inner cage (Tab)",()=>t.setMode("edit"),"mode-edit"),u=>u.mode==="edit")),l(...xL.map(([u,p,g])=>o(At(u,g,()=>t.toggleSelecting(p),`select-${p}`),x=>x.selecting===p))),d,l(o(At(mA,"Along the world's axes (W)",()=>n.store.set({axes:"world"}),"axes-world"),u=>u.axes==="world"),o(At(eA,"Along the cage's own axes (W)",()=>n.store.set({axes:"cage"}),"axes-cage"),u=>u.axes==="cage")),a(c,h,o(At(Jm,"Measure between two points (Shift+M); sets the scale in meters",()=>t.toggleMeasuring(),"measure"),u=>u.measured!==null),o(At(Zm,"Place hotspots on the surface (Shift+H)",()=>t.toggleHotspots(),"place-hotspot"),u=>u.placesHotspot),o(At(tA,"Show or hide the cages (Shift+O)",()=>t.toggle("cages"),"cages"),u=>u.cages))),n.store.watch(["hello","tool","selecting","measured","placesHotspot","mode","cage","axes","snap","proportional","cages"],u=>{for(const p of r)p.hidden=Xe(u);for(const[p,g]of i)p.classList.toggle("on",g(u));for(const p of s)p.classList.toggle("away",u.mode!=="set"||Xe(u))}),e}const wL=[["color","Color"],["depth","Depth"],["opacity","Opacity"],["normals","Normals"]];function yL(n,t,e){const i=G("span",{class:"scene-name"}),s=G("span",{class:"unsaved",title:"There are unsaved changes"}),r=G("span",{class:"mode-badge"}),o=At(eg,"Undo (Ctrl+Z)",()=>t.command("undo"),"undo"),a=At(LA,"Redo (Ctrl+Shift+Z)",()=>t.command("redo"),"redo"),l=wL.map(([b,E])=>G("button",{type:"button",title:`${E} (V)`,onclick:()=>t.setView(b),data:{view:b}},E)),c=At(lA,"Before and after, side by side (P); hold B for before",()=>t.toggleSplit(),"split"),h=At(gA,"Deformed lattice (L)",()=>t.toggle("grid"),"grid"),d=G("input",{type:"file",accept:[".yaml",".yml",".json",".obj",...nm].join(),hidden:!0});d.onchange=()=>{const b=d.files?.[0];b&&t.load(b),d.value=""};const u=G("input",{type:"file",accept:".obj,.ply,.glb",hidden:!0,class:"mesh-file"});u.onchange=()=>{const b=u.files?.[0];b&&t.placeMesh(b),u.value=""};const p=At(RA,"A mesh file as a cage…",()=>u.click(),"mesh-cage"),g=At(OA,"Save (Ctrl+S)",()=>t.save(),"save"),x=At(UA,"Save as… (Ctrl+Shift+S)",()=>e.saveAs(),"save-as"),m=At(fA,"Load an edit file, or open splats…",()=>d.click(),"load"),f=At(pA,"Download the edited scene: splats, or a page…",()=>e.download(!1),"download"),_=At(TA,"Panel (N)",()=>t.toggle("panel"),"panel-toggle");n.store.watch(["state","hello","view","split","grid","panel","mode"],b=>{i.textContent=b.hello?.name??"",s.classList.toggle("shown",b.state?.saved===!1),g.classList.toggle("due",b.state?.saved===!1);const E=Xe(b);for(const T of[g,x,m,p])T.hidden=E;o.disabled=E||(b.state?.entry??0)<=0,a.disabled=E||b.state===null||b.state.entry>=b.state.history.length-1;for(const T of l)T.classList.toggle("on",T.dataset.view===b.view);f.hidden=E,c.classList.toggle("on",b.split!==null),h.classList.toggle("on",b.grid),_.classList.toggle("on",b.panel),r.textContent=E?"Read only":b.mode==="set"?"Set cages":"Edit field",r.title=E?Kr:"",r.dataset.mode=E?"look":b.mode});const M=Oc(iA,"Screenshot of the field","screenshot.png","screenshot.png");return n.store.watch(["hello"],({hello:b})=>{const E=new URLSearchParams(location.search);b!==null&&E.set("page",String(b.page)),M.search=E.toString()}),G("header",{class:"top"},G("span",{class:"brand"},"cagefield"),i,s,r,G("span",{class:"space"}),G("div",{class:"group"},o,a),G("div",{class:"segments"},...l),G("div",{class:"group"},c,h),G("span",{class:"space"}),G("div",{class:"group"},g,x,m,p,Oc(Km,"Download the edit file",`edits.yaml${location.search}`,"edits.yaml"),f,M),G("div",{class:"group"},At(oA,"All keys (?)",()=>t.toggle("help"),"keys-button"),_),d,u)}const Jh=G("main",{class:"view"}),za=G("div",{class:"editor"},Jh);document.body.append(za);const $t=new RT(Jh),_i=jA($t),In=new LS($t,()=>_i.saveAs()),o0=new ZT($t),sr=new HT($t),a0=new uS($t,n=>_i.scale(n)),tu=new cC($t,In,_i);sr.placeHotspot=(n,t)=>tu.place(n,t);const l0=new fS($t,{plane:n=>$t.send({type:"up_change",by:"points",points:n}),pairs:n=>_i.align(n)});sr.pickPoint=(n,t)=>l0.add(n,t);sr.measure=(n,t)=>a0.add(n,t);const c0=DT($t,In,sr,o0,_i);UT($t,In,sr,c0);const h0=G("fieldset",{class:"controls"},tC($t,In,_i),Q3($t,In),mL($t,In),oC($t),hL($t,In,_i),tu.panel,WA($t,In),dC($t)),SL=G("aside",{class:"panel"},h0);Jh.append(o0.element,a0.element,l0.element,tu.marks,iL($t,sr));za.append(yL($t,In,_i),bL($t,In),SL,_L($t),rC($t,c0),_i.element);$t.store.watch(["hello"],n=>{h0.disabled=Xe(n),za.classList.toggle("looking",Xe(n))});$t.store.watch(["panel"],n=>za.classList.toggle("wide",!n.panel));$t.store.watch(["state","hello"],({hello:n,state:t})=>{document.title=`${t?.saved===!1?"● ":""}${n?.name??"cagefield"}`});addEventListener("beforeunload",n=>{$t.store.now.hello!==null&&SS($t.store.now,$t.viewport.c2w),$t.store.now.state?.saved===!1&&!Xe($t.store.now)&&n.preventDefault()});addEventListener("dragover",n=>{n.dataTransfer?.types.includes("Files")&&n.preventDefault()});addEventListener("drop",n=>{const t=n.dataTransfer?.files[0];t!==void 0&&(n.preventDefault(),Xe($t.store.now)?$t.say(Kr,"warning"):In.load(t))});document.addEventListener("visibilitychange",()=>{document.hidden&&$t.player.stop()});window.cagefield=PT($t);
